"""Bad inputs as a user meets them: the real command in a process of its own; and how many were tried at all."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.hostile.bad_documents import CAMPAIGNS, PERSONAS, POLICIES, SCENES
from tests.hostile.bad_roads import NETS, ROUTE_FILES
from tests.hostile.bad_run_folders import RUNS
from tests.hostile.inputs import (
    CHECK,
    Bad,
    Said,
    all_at_release,
    assert_refused,
    seal,
    traces_of,
    write_project,
    write_run,
)
from tests.support.processes import in_session
from tests.support.tiny import HARNESS, PATIENCE_S
from tests.support.work import children_s

TABLES = {
    "campaign": CAMPAIGNS,
    "persona": PERSONAS,
    "scene": SCENES,
    "net": NETS,
    "routes": ROUTE_FILES,
    "policy": POLICIES,
    "run": RUNS,
}
LEAST = 300
# Names of the tables' rows, all of which the other tests try within one process: one of each class for a campaign and a
# run, and some of each kind
CLASSES = ("empty", "UTF-16", "half of it", "a folder", "a pipe", "a device", "a gigabyte", "deeply nested lists")
BY_NAME = {
    *(f"{file}: {each}" for file in ("tiny.toml", "report: manifest.json") for each in CLASSES),
    *("merge.net.xml: a pipe", "policy.safetensors: a gigabyte", "report: played.csv: a device"),
    *("tiny.toml: a key with 5,000 dots", "tiny.toml: a misspelt key", "tiny.toml: assessment.episodes huge"),
    *("anna.toml: a misspelt term", "anna.toml: a key that moves the cursor", "scene.toml: a start beyond the road"),
    *("scene.toml: out of the folder by a link", "merge.net.xml: an entity bomb", "merge.net.xml: an include"),
    *("merge.net.xml: a document type of the net", "merge.net.xml: a lane's length is zero"),
    *("merge.net.xml: foes that are too many", "merge.net.xml: a light that writes"),
    *("merge.rou.xml: a device that writes", "merge.rou.xml: an entity of a file", "a policy: ego.zip"),
    *("merge.rou.xml: a route over a missing edge", "merge.rou.xml: a flow of a billion"),
    *("policy.safetensors: an infinite weight", "policy.json: a pickle"),
    "policy.safetensors: a header as long as can be",
    *("replay: manifest with a stage that leads up", "report: replays leads out of the run"),
    *("report: traces with a place that is none", "report: a game that was not recorded"),
}
SAMPLE = [bad for rows in TABLES.values() for bad in rows if bad.name in BY_NAME]


def test_sample__has_what_it_names() -> None:
    assert {bad.name for bad in SAMPLE} >= BY_NAME
    assert {command for bad in SAMPLE for command in (bad.command[0],)} == {"check", "report", "replay"}


@pytest.mark.parametrize("bad", all_at_release(SAMPLE))  # a process each, of a second and a half
def test_command__refuses_a_bad_input_and_leaves_nothing_behind(bad: Bad, tmp_path: Path) -> None:
    project = write_project(tmp_path)
    if bad.command != CHECK:
        write_run(tmp_path)
    bad.spoil(project)
    seal(project / "run")
    for name in ("here", "scratch"):
        (tmp_path / name).mkdir()
    before = traces_of(tmp_path)
    verb, named, *more = ("campaign", *bad.command[1:]) if bad.command == CHECK else bad.command
    worked = children_s()
    command = subprocess.Popen(
        [HARNESS, verb, project / named, *more],
        cwd=tmp_path / "here",
        env={**os.environ, "TMPDIR": str(tmp_path / "scratch")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        out, err = command.communicate(timeout=PATIENCE_S)
    finally:
        left = in_session(command.pid)
        command.kill()
    assert_refused(Said(command.returncode, out, err, 0.0, children_s() - worked), bad.words)
    assert left == []
    assert traces_of(tmp_path) == before


def test_inputs__that_were_tried_are_many_and_each_another(tmp_path: Path) -> None:
    """Each row spoils a copy of the same project: what comes of it is the input."""
    tried = {}
    for kind, rows in TABLES.items():
        for k, bad in enumerate(rows):
            if bad.command != CHECK:
                continue  # run folders: counted below by name, each is spoiled in test_documents
            folder = tmp_path / f"{kind}{k}"
            project = write_project(folder)
            bad.spoil(project)
            tried[bad.name] = repr(sorted(traces_of(project).items())).replace(str(folder), "")
            shutil.rmtree(folder)
    assert len(set(tried.values())) == len(tried), "two rows are the same input"
    names = [bad.name for rows in TABLES.values() for bad in rows]
    assert len(set(names)) == len(names)
    assert len(tried) >= LEAST
    assert all(len(rows) >= 40 for rows in TABLES.values())
