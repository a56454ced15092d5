"""Tables of bad campaigns, personas, scenes and policies; see `hostile` for what must come of each."""

# ruff: noqa: E501
# fmt: off

from __future__ import annotations

import json
import pickle
import shutil
import zipfile
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from tests.hostile.inputs import (
    CAMPAIGN,
    CARD,
    PERSONA,
    SCENE,
    TENSORS,
    Bad,
    Spoil,
    changed,
    edit,
    inserted,
    moved_out,
    no_numbers,
    put,
    several,
    whole_file,
)
from tests.support.policies import some_policy


def bombs(file: str) -> list[Bad]:
    """TOML that is long in another way than its bytes."""
    name = Path(file).name
    return [
        Bad(f"{name}: a number of 5,000 digits", inserted(file, b"\nsize = " + b"9" * 5000 + b"\n", 0.0), (name,)),
        Bad(f"{name}: a key with 5,000 dots", inserted(file, b"a." * 5000 + b"a = 1\n", 0.0), (name,)),
        Bad(f"{name}: a key with 400,000 dots", inserted(file, b"a." * 400_000 + b"a = 1\n", 0.0), (name, "nested too deeply")),
        Bad(f"{name}: a key with 5,000 quoted dots", inserted(file, b"x = {" + b"'a' . " * 5000 + b"a = 1}\n", 0.0), (name, "nested too deeply")),
        Bad(f"{name}: 20,000 unknown keys", inserted(file, b"\n".join(b"k%d = 1" % k for k in range(20_000)) + b"\n", 0.0), (name, "unknown key")),
        Bad(f"{name}: a key of 100,000 letters", inserted(file, b"k" * 100_000 + b" = 1\n", 0.0), (name, "unknown key")),
        Bad(f"{name}: a byte order mark", inserted(file, b"\xef\xbb\xbf", 0.0), (name, "byte order mark")),
        Bad(f"{name}: the same key twice", inserted(file, b"name = 'b'\n", 0.0), (name, "not valid TOML")),
        Bad(f"{name}: markup for a key", inserted(file, b"'<script>alert(1)</script>' = 1\n", 0.0), (name, "unknown key")),
        Bad(f"{name}: a key that moves the cursor", inserted(file, b'"\\u001b[2J\\nall is well" = 1\n', 0.0), (name, "\\x1b[2J\\nall is well")),
        Bad(f"{name}: a key that turns the line round", inserted(file, b'"\\u202egnorw" = 1\n', 0.0), (name, "\\u202egnorw")),
    ]


PERSON = '[[non_ego]]\nvehicle = "non_ego"\nlane = "approach_0"\nposition_m = [20.0, 20.1]\nspeed_mps = [11.0, 14.0]\n'


# --- campaigns --------------------------------------------------------------------------------------------------------

ODD_NAMES = {
    "a way up": "../tiny",
    "an absolute way": "/tiny",
    "a line end": "ti\\nny",
    "a zero": "ti\\u0000ny",
    "markup": "<b>tiny</b>",
    "a dash first": "-tiny",
    "a dot first": ".tiny",
    "nothing": "",
    "a space": "ti ny",
    "forty letters and one": "x" * 41,
    "a name in Greek": "τίνι",
    "right to left": "a\\u202eb",
    "a percent sign": "%s",
}
ODD_PATHS = {
    "nowhere": ("nowhere", "there is no"),
    "a line end": ("a\\nb", "possible"),
    "a zero": ("a\\u0000b", "possible"),
    "an escape": ("a\\u001b[31m", "possible"),
    "nothing": ("", "possible"),
    "600 letters": ("x" * 600, "possible"),
    "400 letters": ("x" * 400, ""),
    "a way far up": ("../" * 100 + "nowhere/x", "nowhere"),
    "a device": ("/dev/zero", ""),
    "an address": ("http://localhost:1/x", "there is no"),
    "a file address": ("file:///etc/hostname", "there is no"),
    "a home": ("~/x", "there is no"),
    "a variable": ("$HOME", "there is no"),
}


def odd_paths(key: str, old: str, begin: str = "", end: str = "", nothing: str = "there is no") -> list[Bad]:
    return [
        Bad(f"tiny.toml: {key} is {way}", edit(CAMPAIGN, old, f'{begin}"{path}"{end}'), (nothing if word == "there is no" else word or path,))
        for way, (path, word) in ODD_PATHS.items()
    ]


CAMPAIGNS = [
    *whole_file(CAMPAIGN),
    *bombs(CAMPAIGN),
    *no_numbers(CAMPAIGN, "episodes = 4", "assessment.episodes"),
    *no_numbers(CAMPAIGN, "significance = 0.01", "assessment.significance"),
    *no_numbers(CAMPAIGN, "learning_rate = 1e-4", "training.learning_rate"),
    *no_numbers(CAMPAIGN, "alone_share = 0.25", "non_ego_training.alone_share"),
    Bad("tiny.toml: a crowd for one person", edit(CAMPAIGN, "[assessment]", '[[crowd]]\nname = "mixed"\npersonas = ["anna", "anna"]\n[assessment]'), ("tiny.toml: crowd[0].personas", "people of the scene: 1")),
    Bad("tiny.toml: a crowd of one", edit(CAMPAIGN, "[assessment]", '[[crowd]]\nname = "mixed"\npersonas = ["anna"]\n[assessment]'), ("tiny.toml: crowd[0].personas",)),
    *(Bad(f"tiny.toml: named {way}", edit(CAMPAIGN, '"tiny"', f'"{name}"'), ("tiny.toml: name",)) for way, name in ODD_NAMES.items()),
    *odd_paths("scene", '"../networks/road"'),
    *odd_paths("personas[0]", '["../personas/anna.toml"]', "[", "]"),
    *odd_paths("ego.driver", '"../policies/mine"', nothing="ego.driver"),
    *changed(
        CAMPAIGN,
        ("a misspelt key", "seeds = [1]", "sede = [1]", ("sede: unknown key", "'seeds'")),
        ("a misspelt table", "[assessment]", "[asessment]", ("asessment: unknown key", "'assessment'")),
        ("a key of another table", "episodes = 4", "episodes = 4\nsteps = 3", ("assessment.steps", "unknown key")),
        ("a table for a list", "seeds = [1]", "seeds = { a = 1 }", ("seeds",)),
        ("a seed twice", "seeds = [1]", "seeds = [1, 1]", ("seeds", "twice")),
        ("a negative seed", "seeds = [1]", "seeds = [-1]", ("seeds[0]",)),
        ("a seed of 400 digits", "seeds = [1]", f"seeds = [1{'0' * 400}]", ("seeds[0]",)),
        ("101 seeds", "seeds = [1]", f"seeds = {list(range(101))}", ("seeds",)),
        ("a persona that is a number", '["../personas/anna.toml"]', "[7]", ("personas[0]",)),
        ("51 personas", '["../personas/anna.toml"]', str(["../personas/anna.toml"] * 51), ("personas",)),
        ("a persona twice", '["../personas/anna.toml"]', str(["../personas/anna.toml"] * 2), ("personas", "'anna' too")),
        ("no scene", 'scene = "../networks/road"', "", ("scene: is missing",)),
        ("a driver misspelt", '"../policies/mine"', '"lerned"', ("ego.driver", "'learned'")),
        ("a driver that is a program", '"../policies/mine"', '"os.system"', ("ego.driver",)),
        ("a buffer that is no multiple", "buffer = 512", "buffer = 515", ("training", "multiple")),
        ("per cent for a share", "[assessment]", "[competence]\nego_goal_share = 97\n[assessment]", ("competence.ego_goal_share",)),
        ("no layers", "network = [8]", "network = []", ("training.network",)),
        ("a layer of none", "network = [8]", "network = [0]", ("training.network[0]",)),
        ("policies, and how to train", "seeds = [1]", 'seeds = [1]\npolicies = "../policies"', ("training",)),
    ),
    Bad("tiny.toml: a persona misspelt", edit(CAMPAIGN, "anna.toml", "ana.toml"), ("ana.toml", "there is no such file", "'anna.toml'")),
    Bad("tiny.toml: a scene misspelt", edit(CAMPAIGN, "networks/road", "networks/raod"), ("raod", "there is no")),
    Bad("tiny.toml: no personas", edit(CAMPAIGN, 'personas = ["../personas/anna.toml"]\n', ""), ("tiny.toml: personas",)),
    Bad("tiny.toml: a persona for a scene", edit(CAMPAIGN, "../networks/road", "../personas/anna.toml"), ("anna.toml",)),
    Bad("tiny.toml: a scene for a persona", edit(CAMPAIGN, "../personas/anna.toml", "../networks/road"), ("road", "is a folder")),
    Bad("tiny.toml: a scene for a policy", edit(CAMPAIGN, "../policies/mine", "../networks/road"), ("policy.json", "there is no such file")),
    Bad("tiny.toml: no policies where they should be", several(edit(CAMPAIGN, "seeds = [1]", 'seeds = [1]\npolicies = "../policis"'), edit(CAMPAIGN, "[training]\nsteps = 2048\nlearning_rate = 1e-4\ngames = 8\nbuffer = 512\nminibatch = 128\nnetwork = [8]\nclip = 0.1\n[non_ego_training]\nalone_share = 0.25\n", "")), ("tiny.toml: policies", "'policies'")),
]

# --- personas ---------------------------------------------------------------------------------------------------------

PERSONAS = [
    *whole_file(PERSONA, resolved=True),
    *bombs(PERSONA),
    *no_numbers(PERSONA, "progress = 1.0", "operational.terms.progress"),
    *no_numbers(PERSONA, "mean_attentive_s = 5.0", "attention.mean_attentive_s"),
    *no_numbers(PERSONA, "no_shoulder_glance_share = 0.5", "perception.no_shoulder_glance_share"),
    *changed(
        PERSONA,
        *(
            (f"a perception of {line}", "no_shoulder_glance_share = 0.5", line, said)
            for line, said in {
                "looked_but_failed_to_see_share = 0.5": ("perception", "noticed_within_m"),
                "noticed_within_m = 5.0": ("perception", "looked_but_failed_to_see_share"),
                "range_m = 0.0": ("perception.range_m",),
                "rnge_m = 5.0": ("perception.rnge_m", "'range_m'"),
                "distance_error = -0.1": ("perception.distance_error",),
            }.items()
        ),
        *(
            (f"a body of {line}", "[perception]", f"{table}\n{line}\n[perception]", said)
            for table, line, said in (
                ("[reaction]", "delay_s = [0.5, 0.2]", ("reaction.delay_s", "empty")),
                ("[reaction]", "delay_s = [-0.5, 0.2]", ("reaction.delay_s[0]", "-0.5 is not possible")),
                ("[reaction]", "delay_s = [0.5, 6.0]", ("reaction.delay_s[1]", "6.0 is not possible")),
                ("[reaction]", "delay_s = [nan, nan]", ("reaction.delay_s",)),
                ("[reaction]", "delay_s = 0.5", ("reaction.delay_s",)),
                ("[actuators]", "throttle_share = 0.0", ("actuators.throttle_share",)),
                ("[actuators]", "braking_share = 1.5", ("actuators.braking_share",)),
                ("[actuators]", "stering_share = 0.5", ("actuators.stering_share", "'steering_share'")),
            )
        ),
    ),
    *(Bad(f"anna.toml: named {way}", edit(PERSONA, '"anna"', f'"{name}"'), ("anna.toml: name",)) for way, name in ODD_NAMES.items()),
    *changed(
        PERSONA,
        ("a misspelt key", "description =", "descripton =", ("descripton: unknown key", "'description'")),
        ("a misspelt term", "progress = 1.0", "progres = 1.0", ("operational.terms.progres", "'progress'")),
        ("a term of another group", "progress = 1.0", "collision = 1.0", ("operational.terms.collision", "safety")),
        ("a term without its limit", "{ weight = 1.0, within_m = 1.0 }", "1.0", ("safety.terms.clearance", "within_m")),
        ("a term with another's limit", "within_m = 1.0 }", "within_s = 1.0 }", ("safety.terms.clearance", "within_m")),
        ("a negative weight", "progress = 1.0", "progress = -1.0", ("operational.terms.progress",)),
        ("a negative coefficient", "[human]\nweight = 1.0", "[human]\nweight = -1.0", ("human.weight",)),
        ("a quantity misspelt", "speed_over_limit", "sped_over_limit", ("human.fuzzy[0].quantity", "'speed_over_limit'")),
        ("points that fall", "[[0.0, 0.0], [0.2, 1.0]]", "[[0.2, 0.0], [0.0, 1.0]]", ("points", "increase")),
        ("a membership of two", "[0.2, 1.0]", "[0.2, 2.0]", ("points[1][1]",)),
        ("points as far as numbers go", "[0.2, 1.0]", "[1e308, 1.0]", ("points[1][0]",)),
        ("a point of one number", "[0.2, 1.0]", "[0.2]", ("points[1][1]: is missing",)),
        ("no points", "points = [[0.0, 0.0], [0.2, 1.0]]", "points = []", ("points",)),
        ("a worth without end", "value = 1.0", "value = inf", ("value",)),
        ("pay for a crash", '"speed_over_limit"\nsets = [{ name = "fast", points = [[0.0, 0.0], [0.2, 1.0]]', '"clearance_m"\nsets = [{ name = "fast", points = [[0.0, 1.0], [0.2, 0.0]]', ("human.fuzzy[0]", "crash")),
        ("a fuzzy term with a term's name", '"thrill"', '"progress"', ("human.fuzzy[0].name", "'progress'")),
        ("a set named by markup", '"fast"', '"<b>"', ("human.fuzzy[0].sets[0].name",)),
        ("a lapse of no time", "lapse_s = [1.0, 2.0]", "lapse_s = [0.0, 2.0]", ("attention.lapse_s",)),
        ("three ends of an interval", "lapse_s = [1.0, 2.0]", "lapse_s = [1.0, 2.0, 3.0]", ("attention.lapse_s",)),
        ("decisions misspelt", '"mode"', '"mood"', ("decisions", "'mode'")),
        ("a figure of people misspelt", "[attention]", '[[unlike_people]]\nfigure = "max_jerk"\nreason = "It is made for a test."\n[attention]', ("unlike_people[0].figure", "'max_jerk_mps3'")),
        ("a figure of people without a reason", "[attention]", '[[unlike_people]]\nfigure = "max_jerk_mps3"\n[attention]', ("unlike_people[0].reason: is missing",)),
        ("a figure of people twice", "[attention]", 2 * '[[unlike_people]]\nfigure = "max_jerk_mps3"\nreason = "It is made for a test."\n' + "[attention]", ("unlike_people[1].figure", "'max_jerk_mps3' occurs twice")),
        ("no source", "[[sources]]", "[[human.sources]]", ("sources: is missing",)),
        ("a description of a megabyte", "Somebody who wants to get there.", "x" * 900_000, ("description",)),
        ("a citation of nothing", '"nobody, nowhere"', '""', ("sources[0].citation",)),
        ("a program for a weight", "[human]\nweight = 1.0", '[human]\nweight = "__import__(\'os\').system(\'id\')"', ("human.weight",)),
    ),
]

# --- scenes -----------------------------------------------------------------------------------------------------------

SCENES = [
    *whole_file(SCENE),
    *bombs(SCENE),
    *no_numbers(SCENE, "friction = 0.8 ", "friction"),
    *no_numbers(SCENE, "time_limit_s = 25.0", "time_limit_s"),
    *no_numbers(SCENE, "step_length_s = 0.1", "step_length_s"),
    *no_numbers(SCENE, "position_m = 45.0", "goal.position_m"),
    *(Bad(f"scene.toml: named {way}", edit(SCENE, '"merge"', f'"{name}"'), ("scene.toml: name",)) for way, name in ODD_NAMES.items()),
    *(
        Bad(f"scene.toml: {key} is {path!r}", edit(SCENE, f'{key} = "merge.{short}.xml"', f'{key} = "{path}"'), (f"scene.toml: {key}", "possible"))
        for key, short in (("net", "net"), ("routes", "rou"))
        for path in ("../road/merge.xml", "/etc/passwd", "..", ".hidden.xml", "a/b.xml", "a\\\\b.xml", "a\\nb.xml", "http://localhost/a.xml", "", "<a>.xml", "a;b.xml", "x" * 101)
    ),
    *changed(
        SCENE,
        ("a misspelt key", "friction =", "fricton =", ("fricton: unknown key", "'friction'")),
        ("a vehicle misspelt", "vehicle = \"ego\"", "vehicle = \"eggo\"", ("ego.vehicle", "'ego'")),
        ("a lane misspelt", '"approach_1"', '"aproach_1"', ("ego.lane", "'approach_1'")),
        ("a lane inside a junction", '"approach_1"', '":taper_0_0"', ("ego.lane",)),
        ("a lane off the route", '"approach_1"', '"exit_0"', ("ego",)),
        ("an edge misspelt", 'edge = "exit"', 'edge = "exti"', ("goal.edge", "'exit'")),
        ("a goal beyond the road", "position_m = 45.0", "position_m = 95.0", ("goal.position_m", "90 m")),
        ("a goal too near the end", "position_m = 45.0", "position_m = 90.0", ("goal.position_m", "behind the goal")),
        ("a start beyond the road", "[30.0, 45.0]", "[30.0, 4500.0]", ("ego.position_m", "4500")),
        ("a start before the road", "[30.0, 45.0]", "[-30.0, 45.0]", ("ego.position_m", "-30")),
        ("a start that ends before it begins", "[30.0, 45.0]", "[45.0, 30.0]", ("ego.position_m", "empty")),
        ("a start behind the ego's road", "[-8.0, 8.0]", "[-800.0, 8.0]", ("non_ego.beside_ego_m",)),
        ("a speed over the vehicle's", "speed_mps = [11.0, 14.0]", "speed_mps = [11.0, 140.0]", ("ego.speed_mps", "40 m/s")),
        ("a negative speed", "speed_mps = [11.0, 14.0]", "speed_mps = [-11.0, 14.0]", ("ego", "negative")),
        ("no start", "position_m = [30.0, 45.0]", "", ("ego",)),
        ("two starts", "position_m = [30.0, 45.0]", "position_m = [30.0, 45.0]\nbeside_ego_m = [0.0, 1.0]", ("ego",)),
        ("no goal", '[goal]\nedge = "exit"\nposition_m = 45.0', "", ("ego has no goal", "[goal]")),
        ("a car without wheels", "[[non_ego]]", "[ego.actuators]\nwheelbase_m = 0.0\n[[non_ego]]", ("ego.actuators.wheelbase_m",)),
        ("a time limit of a year", "time_limit_s = 25.0", "time_limit_s = 3e7", ("time_limit_s",)),
        ("five people", "[[non_ego]]", PERSON * 4 + "[[non_ego]]", ("non_ego: 5 people", "one to 4")),
        ("three people on one place", "[[non_ego]]", PERSON * 3 + "[[non_ego]]", ("non_ego_2: non_ego and non_ego_2 overlap",)),
        ("a person of several without a vehicle", "[[non_ego]]", PERSON + PERSON.replace('"non_ego"', '"nonego"') + "[[non_ego]]", ("non_ego_2.vehicle", "'non_ego'")),
        ("a pedestrian without a way", "[[non_ego]]", '[[non_ego]]\nkind = "pedestrian"', ("non_ego: a pedestrian needs a way",)),
        ("a car with a way", "[[non_ego]]", "[[non_ego]]\nway = [[0.0, 0.0], [9.0, 0.0]]", ("non_ego: way is a pedestrian's",)),
        ("a kind misspelt", "[[non_ego]]", '[[non_ego]]\nkind = "pedestrain"', ("non_ego.kind", "'pedestrian'")),
    ),
    Bad("scene.toml: a bicycle of the type of a car", edit(SCENE, "[[non_ego]]", '[[non_ego]]\nkind = "bicycle"'), ("merge.rou.xml", "vClass 'passenger'", "bicycle")),
    Bad("scene.toml: a net misspelt", edit(SCENE, '"merge.net.xml"', '"merg.net.xml"'), ("merg.net.xml", "'merge.net.xml'")),
    Bad("scene.toml: the routes for the net", edit(SCENE, '"merge.net.xml"', '"merge.rou.xml"'), ("merge.rou.xml", "is not a SUMO net")),
    Bad("scene.toml: the net for the routes", edit(SCENE, '"merge.rou.xml"', '"merge.net.xml"'), ("merge.net.xml", "is not a SUMO route file")),
    Bad("scene.toml: the sources for the net", edit(SCENE, '"merge.net.xml"', '"merge.nod.xml"'), ("merge.nod.xml", "is not a SUMO net")),
    Bad("scene.toml: out of the folder by a link", moved_out(SCENE), ("scene.toml", "leads out of the scene's folder")),
]

# --- policies ---------------------------------------------------------------------------------------------------------


def tensors(**changes: np.ndarray | None) -> Spoil:
    """A policy with parameters replaced, left out (None) or added; `__` in a name is a dot."""

    def spoil(project: Path) -> None:
        named = {name.replace("__", "."): value for name, value in changes.items()}
        given = {**some_policy().tensors, **named}
        (project / TENSORS).write_bytes(save({name: value for name, value in given.items() if value is not None}))

    return spoil


def card(**changes: object) -> Spoil:
    def spoil(project: Path) -> None:
        given = {**json.loads((project / CARD).read_text()), **changes}
        (project / CARD).write_text(json.dumps({k: v for k, v in given.items() if v is not None}))

    return spoil


def archive(name: str, as_name: str) -> Spoil:
    """A campaign whose ego is a learner's own archive, with a pickle in it."""

    def spoil(project: Path) -> None:
        file = project / "policies" / name
        with zipfile.ZipFile(file, "w") as archived:
            archived.writestr("data", pickle.dumps({"policy": 1}))
        edit(CAMPAIGN, "../policies/mine", as_name)(project)

    return spoil


F32 = np.float32
SHAPES = some_policy().tensors
HEADERS = {
    "a header that is longer than the file": b"\xff\xff\xff\x00\x00\x00\x00\x00{}",
    "a header as long as can be": b"\xff" * 8 + b"{}",
    "a header that is no JSON": b"\x04\0\0\0\0\0\0\0[[[[",
    "a tensor beyond the end": b"\x4a\0\0\0\0\0\0\0" + b'{"log_deviation":{"dtype":"F32","shape":[2],"data_offsets":[0,99999999]}}'.ljust(0x4A),
    "a tensor of minus one": b"\x4a\0\0\0\0\0\0\0" + b'{"log_deviation":{"dtype":"F32","shape":[-1],"data_offsets":[0,8]}}'.ljust(0x4A) + bytes(8),
    "a tensor of more than there is": b"\x4a\0\0\0\0\0\0\0" + b'{"a":{"dtype":"F32","shape":[9999999999,9999],"data_offsets":[0,8]}}'.ljust(0x4A) + bytes(8),
    "a tensor of an unknown kind": b"\x4a\0\0\0\0\0\0\0" + b'{"a":{"dtype":"OBJECT","shape":[2],"data_offsets":[0,8]}}'.ljust(0x4A) + bytes(8),
    "a tensor of half precision of another kind": b"\x4a\0\0\0\0\0\0\0" + b'{"log_deviation":{"dtype":"BF16","shape":[2],"data_offsets":[0,4]}}'.ljust(0x4A) + bytes(4),
}
POLICIES = [
    *whole_file(TENSORS),
    *whole_file(CARD),
    *(Bad(f"policy.safetensors: {way}", put(TENSORS, content), ("policy.safetensors",)) for way, content in HEADERS.items()),
    *(
        Bad(f"policy.safetensors: {way}", tensors(**given), ("policy.safetensors", *words))
        for way, given, words in (
            ("no parameters", dict.fromkeys((name.replace(".", "__") for name in SHAPES), None), ()),
            ("no deviation", {"log_deviation": None}, ("log_deviation",)),
            ("a misspelt parameter", {"actor__1__weight": None, "actor__1__wieght": SHAPES["actor.1.weight"]}, ("actor.1.wieght",)),
            ("a parameter too many", {"extra": np.zeros(2, F32)}, ("extra",)),
            ("a layer too many", {"actor__5__weight": np.zeros((2, 2), F32), "actor__5__bias": np.zeros(2, F32)}, ("actor.2.",)),
            ("a deviation that is no number", {"log_deviation": np.full(2, np.nan, F32)}, ("log_deviation", "not finite")),
            ("an infinite weight", {"actor__1__bias": np.array([np.inf, 0], F32)}, ("actor.1.bias", "not finite")),
            ("a huge weight", {"actor__1__bias": np.array([3e38, 0], F32)}, ("actor.1.bias",)),
            ("double precision", {"actor__1__bias": np.zeros(2, np.float64)}, ("actor.1.bias", "float64")),
            ("three deviations", {"log_deviation": np.zeros(3, F32)}, ("log_deviation",)),
            ("layers that do not fit", {"actor__1__weight": np.zeros((2, 6), F32)}, ("actor",)),
            ("a layer of nobody", {"actor__0__weight": np.zeros((0, 15), F32), "actor__0__bias": np.zeros(0, F32)}, ("actor",)),
            ("three actions", {"actor__1__weight": np.zeros((3, 5), F32), "actor__1__bias": np.zeros(3, F32)}, ("actor", "3 outputs")),
        )
    ),
    *(
        Bad(f"policy.json: {way}", spoil, ("policy.json", *words))
        for way, spoil, words in (
            ("of a later format", card(format=2), ("observation",)),
            ("a format that is text", card(format="1"), ()),
            ("no format", card(format=None), ("'format'",)),
            ("no observation", card(observation=None), ("'observation'",)),
            ("other observations", card(observation=["speed_mps"]), ("observation",)),
            ("observations that are a number", card(observation=7), ("observation",)),
            ("half a character", put(CARD, '{"format": 1, "observation": ["\\ud800"]}'), ()),
            ("a number of 5,000 digits", put(CARD, '{"format": ' + "1" * 5000 + "}"), ()),
            ("a pickle", put(CARD, pickle.dumps({"format": 1})), ()),
        )
    ),
    *(
        Bad(f"a policy: {name}", archive(name, f"../policies/{name}"), ("tiny.toml: ego.driver", "pickles", "policy.safetensors"))
        for name in ("ego.zip", "ego.pkl", "ego.pt", "ego.pth", "ego.ZIP", "ego.ckpt", "ego.bin", "ego")
    ),
    Bad("a policy: an archive that is not there", edit(CAMPAIGN, "../policies/mine", "ppo.zip"), ("ego.driver", "there is no such file")),
    Bad("a policy: the parameters alone", edit(CAMPAIGN, "../policies/mine", "../policies/mine/policy.safetensors"), ("ego.driver",)),
    Bad("a policy: an archive under its parameters' name", put(TENSORS, b"PK\x03\x04" + bytes(500)), ("policy.safetensors",)),
    Bad("a policy: a folder of pickles", several(lambda project: shutil.rmtree(project / "policies" / "mine"), lambda project: (project / "policies" / "mine").mkdir(), lambda project: (project / "policies" / "mine" / "policy.pkl").write_bytes(pickle.dumps(1))), ("policy.json", "there is no such file")),
]
