"""Mistakes in a document are reported together, each with file, key and remedy; a document is immutable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pydantic import ValidationError

from harness.config.campaign import Campaign, resolve
from harness.config.persona import Persona
from harness.config.scene import Scene
from harness.config.toml_reading import Document, nearest, read_document
from harness.errors import Problem, UsageError
from harness.game.human_factors import ActuatorShares, Sight

Write = Callable[[str], Path]

CAMPAIGN = 'name = "c"\nscene = "../networks/merge"\npersonas = ["../personas/speedy.toml"]\n'
SCENE = """
name = "s"
net = "s.net.xml"
routes = "s.rou.xml"
time_limit_s = 25.0
[goal]
edge = "exit"
position_m = 45.0
[ego]
vehicle = "ego"
lane = "approach_1"
position_m = [30.0, 45.0]
speed_mps = [11, 14]
[[non_ego]]
vehicle = "non_ego"
lane = "approach_0"
beside_ego_m = [-8.0, 8.0]
speed_mps = [11.0, 14.0]
"""
GOALS = """
[ego.goal]
edge = "exit"
position_m = 45.0
[non_ego.goal]
edge = "exit"
position_m = 40.0
"""


def arriving(after_s: str, speed_mps: str) -> str:
    """The scene, with a non-ego that is timed by its arrival after the ego."""
    scene = SCENE.replace('lane = "approach_0"\nbeside_ego_m = [-8.0, 8.0]', f"arrival_after_ego_s = {after_s}")
    return scene.replace("[11.0, 14.0]", speed_mps)


def after_ego_of(speed_mps: str) -> str:
    """The same with another range of the ego's speed."""
    return arriving("[1.0, 2.0]", "[11.0, 14.0]").replace("[11, 14]", speed_mps, 1)


PERSONA = """
name = "p"
description = "a person to test with"
[[sources]]
statistic = "so many in a hundred"
citation = "Somebody, 2020"
[operational.terms]
goal = 1
"""
FUZZY = """
[[human.fuzzy]]
name = "thrill"
quantity = "speed_over_limit"
sets = [{ name = "fast", points = [[0.0, 0.0], [0.2, 1.0]], value = 1.0 }]
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def to_file(text: str) -> Path:
        path = tmp_path / "a.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


def problems(path: Path, model: type[Document]) -> list[Problem]:
    with pytest.raises(UsageError) as raised:
        read_document(path, model)
    assert all(each.file == str(path) for each in raised.value.problems)
    assert str(raised.value) == "\n".join(str(each) for each in raised.value.problems)
    return raised.value.problems


def only(path: Path, model: type[Document]) -> tuple[str, str]:
    """Key and text of the only problem."""
    (problem,) = problems(path, model)
    return problem.key, f"{problem.message} ({problem.remedy})" if problem.remedy else problem.message


def test_campaign__defaults_are_the_papers_table_1(write: Write) -> None:
    training = read_document(write(CAMPAIGN), Campaign).training
    values = (training.steps, training.early_convergence, training.discount, training.clip)
    assert values == (3_000_000, True, 0.99, 0.1)
    assert (training.entropy_coefficient, training.learning_rate, training.buffer) == (0.02, 1e-4, 2048)


def test_campaign__paths_are_relative_to_its_own_file() -> None:
    assert resolve(Path("/a/campaigns/c.toml"), "../personas/p.toml") == Path("/a/personas/p.toml")


def test_number__an_integer_is_accepted_as_a_float(write: Write) -> None:
    assert read_document(write(SCENE), Scene).ego.speed_mps == (11.0, 14.0)
    assert read_document(write(PERSONA), Persona).payoff.terms[0].weight == 1.0


@pytest.mark.parametrize(
    ("model", "text", "key", "message"),
    [
        # unknown keys, at every depth
        (Campaign, CAMPAIGN + "[trainin]", "trainin", "unknown key (did you mean 'training'?)"),
        (Campaign, CAMPAIGN + "[training]\nlr = 1", "training.lr", "unknown key (valid: buffer, clip, "),
        (Scene, SCENE + "[ego.actuators]\nwheelbse_m = 2", "ego.actuators.wheelbse_m", "(did you mean 'wheelbase_m'?)"),
        (Persona, PERSONA + FUZZY + "wieght = 1", "human.fuzzy[0].wieght", "unknown key (did you mean 'weight'?)"),
        # missing keys
        (Campaign, CAMPAIGN.replace('name = "c"', ""), "name", "is missing (add it)"),
        (Persona, PERSONA + '[[sources]]\nstatistic = "many of them"', "sources[1].citation", "is missing (add it)"),
        (Scene, SCENE.replace("[30.0, 45.0]", "[30.0]"), "ego.position_m[1]", "is missing (add it)"),
        # out of range
        (Scene, "friction = 3.0" + SCENE, "friction", "3.0 is not possible (input should be less than or equal"),
        (Scene, "step_length_s = 0" + SCENE, "step_length_s", "0 is not possible (input should be greater than"),
        (Campaign, CAMPAIGN + "seeds = []", "seeds", "this list is not possible (list should have at least 1 item"),
        # not finite
        (Scene, "friction = nan" + SCENE, "friction", "nan is not possible (input should be a finite number)"),
        (Scene, "friction = inf" + SCENE, "friction", "inf is not possible (input should be a finite number)"),
        # wrong types
        (Scene, 'friction = "dry"' + SCENE, "friction", "'dry' is not possible (input should be a valid number)"),
        (Scene, "friction = true" + SCENE, "friction", "True is not possible (input should be a valid number)"),
        (Campaign, CAMPAIGN + "seeds = 1", "seeds", "1 is not possible (input should be a valid array)"),
        (Campaign, CAMPAIGN + "seeds = [1.5]", "seeds[0]", "1.5 is not possible (input should be a valid integer)"),
        (Campaign, CAMPAIGN + "training = 3", "training", "3 is not possible (input should be an object)"),
        (Campaign, CAMPAIGN + "[training]\nsteps = 2024-01-01", "training.steps", "'2024-01-01' is not possible ("),
        (Campaign, CAMPAIGN + "[[training]]\nsteps = 1", "training", "this list is not possible (input should be"),
        # what does not fit together
        (Scene, SCENE.replace("beside_ego_m = [-8.0, 8.0]", ""), "non_ego", "give one of position_m, beside_ego_m"),
        (Scene, SCENE.replace("position_m = [30.0, 45.0]", "beside_ego_m = [0, 1]"), "", "the ego can't start"),
        (Scene, SCENE.replace("beside_ego_m", "route_m"), "non_ego", "route_m is along the route: leave out lane"),
        (Scene, SCENE.replace('lane = "approach_1"\n', ""), "ego", "position_m needs the lane of the start"),
        (Scene, arriving("[1.0, 2.0]", "[0, 14]"), "non_ego", "arrival_after_ego_s needs speeds above 0"),
        (Scene, after_ego_of("[0, 0]"), "ego.speed_mps", "it may stand (give speeds above 0, or give non_ego route_m"),
        (Scene, after_ego_of("[0, 9]"), "ego.speed_mps", "it may stand (give speeds above 0, or give non_ego route_m"),
        (Scene, arriving("[2.0, 1.0]", "[11, 14]"), "non_ego.arrival_after_ego_s", "is empty: write the lower end"),
        (Scene, SCENE.replace("[goal]", "[ego.goal]"), "", "non_ego has no goal: give [goal] for all players, or"),
        (Scene, SCENE + GOALS, "", "every player has a goal of its own: leave out [goal]"),
        (Campaign, CAMPAIGN + "[training]\nminibatch = 4096", "training", "must not exceed buffer (2048)"),
        (Campaign, CAMPAIGN + "[training]\ninitial_deviation = 0.6", "training", "must not exceed max_deviation (0.5)"),
        (Campaign, CAMPAIGN + "[acceptance]\nego = 'naive'", "acceptance", "no bound is given"),
        (Campaign, CAMPAIGN + "[acceptance]\ngap_share = 0.1", "acceptance.gap_share", "without [best_response]"),
        (Campaign, CAMPAIGN + "[assessment]\nreference_drivers = false\n[acceptance]\npreventable_failure_rate = 0.1",
         "acceptance.preventable_failure_rate", "is not judged which failures are preventable"),
        (Persona, PERSONA + FUZZY + FUZZY, "human.fuzzy[1].name", "'thrill' occurs twice"),
    ],
)  # fmt: skip
def test_mistake__is_reported_with_key_and_remedy(
    write: Write, model: type[Document], text: str, key: str, message: str
) -> None:
    reported_key, reported = only(write(text), model)
    assert reported_key == key
    assert message in reported


def test_mistakes__are_reported_together(write: Write) -> None:
    text = CAMPAIGN.replace('name = "c"', "") + "seeds = [-1]\nsede = 1\n[training]\nclip = 2.0\n"
    assert [each.key for each in problems(write(text), Campaign)] == ["name", "sede", "seeds[0]", "training.clip"]


@pytest.mark.parametrize("text", ['name = "c', "name = ", "[a\n", "a = 1\na = 2\n", "a = " + "[" * 3000])
def test_file__not_toml(write: Write, text: str) -> None:
    key, message = only(write(text), Campaign)
    assert key == ""
    assert message.startswith("is not valid TOML: ")
    assert message.endswith("(correct the file at this line)")


def test_file__missing_names_the_nearest(write: Write) -> None:
    path = write(CAMPAIGN).with_name("speedy.toml")
    path.write_text("", encoding="utf-8")
    assert only(path.with_name("speddy.toml"), Campaign) == ("", "there is no such file (did you mean 'speedy.toml'?)")
    missing = path.parent / "nowhere" / "c.toml"
    assert only(missing, Campaign)[1] == f"there is no such file (there is no folder {missing.parent})"


def test_nearest__is_one_word_or_all_words() -> None:
    assert nearest("colour", ["colours", "size"]) == "did you mean 'colours'?"
    assert nearest("xyz", ["b", "a"]) == "valid: a, b"
    assert nearest("xyz", []) == "there are none"


def test_document__is_frozen(write: Write) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        read_document(write(CAMPAIGN), Campaign).training.clip = 0.2


def test_persona__limits_survive_a_round_trip(write: Write) -> None:
    limits = (
        "[perception]\nrange_m = 50.0\ndistance_error = 0.1\n"
        "[reaction]\ndelay_s = [0.2, 0.3]\n[actuators]\nbraking_share = 0.5\n"
    )
    person = read_document(write(PERSONA + limits), Persona)
    written = person.model_dump(mode="json")
    assert Persona.model_validate(written, strict=False) == person
    sight = Sight(range_m=50.0, field_of_view_deg=180.0, distance_error=0.1, closing_error_per_s=0.01)
    assert person.human_factors.sight == sight
    assert person.human_factors.delay_s == (0.2, 0.3)
    assert person.human_factors.actuator_shares == ActuatorShares(braking_share=0.5)
