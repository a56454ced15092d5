# ruff: noqa: E501
# fmt: off

"""Tables of run folders that somebody has been at; see `hostile` for what must come of each."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
from collections.abc import Callable
from functools import reduce
from operator import delitem, getitem, setitem
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.hostile.inputs import Bad, Spoil, edit, inserted, link, put, several, whole_file

REPORT, LIST, GAME = ("report", "run"), ("replay", "run", "--list"), ("replay", "run", "naive_alone", "1")
MANIFEST, TABLE = "run/manifest.json", "run/episodes.csv"
GAMES, TRACES = "run/.stages/naive_alone-seed1/played.csv", "run/traces/naive_alone-seed1.parquet"
CURVE, CARD = "run/.stages/speedy-seed1/training.csv", "run/policies/speedy-seed1/policy.json"
SCENE, NET, ROUTES = "run/scene/scene.toml", "run/scene/paper_merge.net.xml", "run/scene/paper_merge.rou.xml"


def to(command: tuple[str, ...], *bad: Bad) -> list[Bad]:
    """The same bad inputs, for another command."""
    return [Bad(f"{command[0]}: {each.name}", each.spoil, each.words, command) for each in bad]


def manifest(change: Callable[[dict[str, Any]], object]) -> Spoil:
    def spoil(project: Path) -> None:
        document = json.loads((project / MANIFEST).read_text())
        change(document)
        (project / MANIFEST).write_text(json.dumps(document))

    return spoil


def around(document: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """The table of a manifest that holds the last of these keys."""
    return reduce(getitem, keys[:-1], document)


def holding(*keys: str, value: object) -> Spoil:
    """A manifest with another value at a place."""
    return manifest(lambda document: setitem(around(document, keys), keys[-1], value))


def lacking(*keys: str) -> Spoil:
    """A manifest without a key."""
    return manifest(lambda document: delitem(around(document, keys), keys[-1]))


def sealed(spoil: Spoil) -> Spoil:
    """A scene whose hashes in the manifest fit it again: who changes a file on purpose can change those as well."""

    def both(project: Path) -> None:
        spoil(project)
        files = [file for file in (project / "run/scene").iterdir() if file.is_file()]
        hashes = {f"scene/{file.name}": hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
        holding("hashes", value=hashes)(project)

    return both


def renamed(stage: str) -> Spoil:
    """A manifest in which a stage is called something that could be a way to somewhere."""

    def change(document: dict[str, Any]) -> None:
        entry = document["stages"].pop("naive_alone-seed1")
        document["stages"][f"{stage}-seed1"] = {**entry, "name": stage}

    return manifest(change)


def traces(change: Callable[[pa.Table], pa.Table]) -> Spoil:
    return lambda project: pq.write_table(change(pq.read_table(project / TRACES)), project / TRACES)


def column(name: str, value: object) -> Spoil:
    """Traces with one value in one column, in their first row."""

    def change(table: pa.Table) -> pa.Table:
        cells = table.column(name).to_pylist()
        cells[0] = value
        return table.set_column(table.schema.get_field_index(name), table.schema.field(name), pa.array(cells, table.schema.field(name).type))

    return traces(change)


def led_out(name: str) -> Spoil:
    """A folder of the run that is a link to a folder beside the project."""

    def spoil(project: Path) -> None:
        outside = project.parent / "outside"
        (outside / "precious").mkdir(parents=True)
        (outside / "precious" / "thesis.tex").write_text("x")
        place = project / "run" / name
        if place.exists():
            os.rename(place, project.parent / "aside")
        place.symlink_to(outside, target_is_directory=True)

    return spoil


STAGE = ("stages", "naive_alone-seed1")
ODD: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "no format": (lacking("format"), ("format",)),
    "a later format": (holding("format", value=2), ("format",)),
    "no name": (lacking("name"), ("name",)),
    "a name that leads up": (holding("name", value="../x"), ("name",)),
    "a name of markup": (holding("name", value="<script>alert(1)</script>"), ("name",)),
    "half a character for a name": (put(MANIFEST, '{"format": 1, "name": "\\ud800"}'), ()),
    "a truth value that is text": (holding("quick", value="no"), ("quick",)),
    "a campaign that is a list": (holding("campaign", value=[]), ("campaign",)),
    "personas that are numbers": (holding("personas", value=[1]), ("personas",)),
    "a persona that leads up": (holding("personas", value=["../x"]), ("personas",)),
    "no seeds": (holding("seeds", value=[]), ("seeds",)),
    "a seed of 400 digits": (holding("seeds", value=[10**400]), ("seeds",)),
    "a negative seed": (holding("seeds", value=[-1]), ("seeds",)),
    "a version that is a table": (holding("versions", "harness", value={}), ("versions",)),
    "stages that are a list": (holding("stages", value=[]), ("stages",)),
    "a stage that is text": (holding(*STAGE, value="done"), ("naive_alone-seed1",)),
    "a stage of no kind": (holding(*STAGE, "kind", value="dance"), ("kind",)),
    "a stage without a seed": (lacking(*STAGE, "seed"), ("seed",)),
    "a stage of another seed": (holding(*STAGE, "seed", value=2), ("naive_alone-seed1",)),
    "a stage of another name": (holding(*STAGE, "name", value="naive"), ("naive_alone-seed1",)),
    "a stage that leads up": (renamed("../../x"), ("../../x",)),
    "a stage that leads to the root": (renamed("/etc/x"), ("/etc/x",)),
    "a stage with a zero": (renamed("a\0b"), ("is no stage",)),
    "a stage of 5,000 letters": (renamed("x" * 20_000), ("stages",)),
    "steps that are text": (holding("stages", "speedy-seed1", "steps", value="many"), ("steps",)),
    "steps below none": (holding("stages", "speedy-seed1", "steps", value=-1), ("steps",)),
    "seconds that are no number": (put(MANIFEST, b'{"format": NaN}'), ("format",)),
    "a duration without end": (holding(*STAGE, "seconds", value=1e308), ("seconds",)),
    "a persona's document that is text": (holding("persona_documents", "speedy", value="x"), ("persona_documents",)),
}
OF_REPORT: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "a campaign of nothing": (holding("campaign", value={}), ("campaign",)),
    "a campaign with an unknown key": (holding("campaign", "colour", value=1), ("campaign", "colour")),
    "a significance that is text": (holding("campaign", "assessment", "significance", value="low"), ("campaign", "significance")),
    "episodes beyond numbers": (holding("campaign", "assessment", "episodes", value=10**400), ("campaign", "episodes")),
    "no harness": (lacking("versions", "harness"), ("versions.harness",)),
    "a training that did not say how it stopped": (lacking("stages", "speedy-seed1", "stopped"), ("stopped",)),
    "an ego of no persona": (lacking("ego_persona"), ("ego_persona",)),
    "a persona's document of nothing": (holding("persona_documents", "speedy", value={}), ("persona_documents.speedy",)),
    "a stage of an unknown persona": (holding("stages", "speedy-seed1", "persona", value="nobody"), ("nobody",)),
}
HEADER = "arm,persona,seed,episode"
TABLES: dict[str, tuple[Callable[[str], Spoil], tuple[str, ...]]] = {
    "a column misspelt": (lambda file: edit(file, "episode,", "episod,"), ("not a table of a run",)),
    "a column too many": (lambda file: edit(file, HEADER, f"extra,{HEADER}"), ("extra",)),
    "a column twice": (lambda file: edit(file, HEADER, f"arm,{HEADER}"), ()),
    "a row too short": (lambda file: inserted(file, b"a,b\n", 1.0), ()),
    "a seed that is text": (lambda file: edit(file, "naive_alone,,1,", "naive_alone,,one,"), ()),
    "a seed of 400 digits": (lambda file: edit(file, "naive_alone,,1,", f"naive_alone,,{'9' * 400},"), ()),
    "an episode of nothing": (lambda file: edit(file, "naive_alone,,1,0,", "naive_alone,,1,,"), ()),
    "a quote that is not closed": (lambda file: edit(file, "naive_alone,", '"naive_alone,'), ()),
    "another kind of table": (lambda file: put(file, "stage,persona,seed\n"), ()),
}
RUNS = [
    *to(REPORT, *whole_file(MANIFEST)[1:], *whole_file(GAMES), *whole_file(TRACES)),
    # the end of a last number may be missing without a trace: that is not tried
    *to(REPORT, *(bad for bad in whole_file(CURVE) if "last bytes" not in bad.name)),
    *to(LIST, *whole_file(TABLE)),
    *(Bad(f"{command[0]}: manifest with {way}", spoil, ("manifest.json", *words), command) for command, odd in ((LIST, ODD), (REPORT, OF_REPORT)) for way, (spoil, words) in odd.items()),
    *(Bad(f"report: played.csv with {way}", spoil(GAMES), ("played.csv", *words), REPORT) for way, (spoil, words) in TABLES.items()),
    *(Bad(f"replay: episodes.csv with {way}", spoil(TABLE), ("episodes.csv", *words), LIST) for way, (spoil, words) in TABLES.items()),
    Bad("report: games of another arm", edit(GAMES, "naive_alone", "../../../x"), ("played.csv", "naive_alone-seed1"), REPORT),
    Bad("report: games of another seed", edit(GAMES, "naive_alone,,1", "naive_alone,,2"), ("played.csv", "naive_alone-seed1"), REPORT),
    Bad("report: a game that was not recorded", edit(GAMES, "naive_alone,,1,1,", "naive_alone,,1,7,"), ("naive_alone-seed1.parquet", "episode 7"), REPORT),
    Bad("report: a run without a scene", lambda project: os.rename(project / "run/scene", project / "scene"), ("scene.toml",), REPORT),
    *(
        Bad(f"{command[0]}: traces with {way}", spoil, ("naive_alone-seed1.parquet",), command)
        for command in (REPORT, ("replay", "run", "naive_alone", "0"))
        for way, spoil in {
            "a place that is none": column("x_m", np.nan),
            "an infinite speed": column("speed_mps", np.inf),
            "a place beyond the world": column("y_m", 1e308),
            "a column left out": traces(lambda table: table.drop_columns(["lapsed"])),
            "a column too many": traces(lambda table: table.append_column("extra", pa.array([0] * len(table)))),
            "text for a number": traces(lambda table: table.set_column(5, "x_m", pa.array(["x"] * len(table)))),
            "an empty cell": column("time_s", None),
            "columns alone": traces(lambda table: table[:0]),
        }.items()
    ),
    Bad("replay: a trace with somebody twice", traces(lambda table: pa.concat_tables([table, table[:1]])), ("naive_alone-seed1.parquet", "two rows in one step"), ("replay", "run", "naive_alone", "0")),
    Bad("replay: a trace before the beginning", column("step", -1), ("naive_alone-seed1.parquet", "steps"), ("replay", "run", "naive_alone", "0")),
    Bad("replay: a trace of a thousand million steps", column("step", 10**9), ("naive_alone-seed1.parquet", "steps"), ("replay", "run", "naive_alone", "0")),
    *(Bad(f"{command[0]}: {name} leads out of the run", led_out(name), (f"run/{name}", "leads out of the run folder"), command) for command in (REPORT, LIST) for name in ("replays", "traces", "policies", "scene", ".stages", "tensorboard", "policies/other")),
    Bad("report: a table that leads out of the run", link(TABLE, "{outside}/secret.txt"), ("episodes.csv", "leads out"), REPORT),
    Bad("report: a page that leads out of the run", link("run/report.html", "{outside}/secret.txt"), ("report.html", "leads out"), REPORT),
    Bad("report: a card that leads out of the run", link("run/policies/speedy-seed1/README.md", "{outside}/secret.txt"), ("README.md", "leads out"), REPORT),
    *(
        Bad(f"report: policy.json with {way}", put(CARD, content), ("policy.json", *words), REPORT)
        for way, content, words in (
            ("a pickle", pickle.dumps({}), ()),
            ("no player", '{"format": 1, "observation": []}', ("player",)),
            ("a player that leads up", '{"format": 1, "observation": [], "player": "../x"}', ("player",)),
            ("a training that is text", '{"format": 1, "observation": [], "player": "ego", "scene": "a", "against": null, "began_from": null, "training": "x"}', ("training",)),
        )
    ),
    *(
        Bad(f"{command[0]}: the run's scene: {way}", sealed(spoil), words, command)
        for command in (REPORT, GAME)
        for way, spoil, words in (
            ("an entity", edit(NET, "<net ", '<!DOCTYPE n [<!ENTITY x SYSTEM "file:///etc/hostname">]><net '), ("paper_merge.net.xml", "entities")),
            ("an include", edit(NET, "</net>", '<include href="/etc/passwd"/></net>'), ("paper_merge.net.xml", "include")),
            ("a device", edit(ROUTES, "<route id", '<vType id="x"><param key="device.ssm.file" value="/tmp/owned"/></vType><route id'), ("paper_merge.rou.xml", "device.ssm.file")),
            ("a net elsewhere", edit(SCENE, '"paper_merge.net.xml"', '"../manifest.json"'), ("scene.toml", "net")),
            ("two mistakes", several(edit(SCENE, "friction =", "fricton ="), edit(ROUTES, "</routes>", "<trip/></routes>")), ("paper_merge.rou.xml", "trip")),
        )
    ),
]
