"""A run folder is one campaign's, and says truly how far it has come."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.storage.checksums import write_checksums
from harness.campaign.storage.manifest import FORMAT
from harness.campaign.storage.run_folder import RunFolder
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.errors import UsageError

PERSONA = read_document("personas/careful.toml", Persona).record()
MANIFEST: dict[str, Any] = {
    "format": FORMAT,
    "name": "tiny",
    "file": "tiny.toml",
    "quick": False,
    "campaign": {"name": "tiny", "scene": "merge", "personas": ["speedy"]},
    "personas": ["speedy"],
    "ego_persona": PERSONA,
    "persona_documents": {"speedy": PERSONA},
    "seeds": [1],
    "hashes": {},
    "versions": {"harness": "1"},
    "stages": {"naive-seed1": {"kind": "training", "name": "naive", "persona": "", "seed": 1, "status": "pending"}},
}


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    folder = RunFolder(tmp_path / "run")
    folder.claim("tiny")
    folder.write_manifest(MANIFEST)
    return folder


def problem_of(action: Callable[[], object]) -> str:
    with pytest.raises(UsageError) as error:
        action()
    (problem,) = error.value.problems
    assert problem.remedy
    return str(problem)


# --- whose it is ------------------------------------------------------------------------------------------------------


def test_claim__an_empty_folder_or_ones_own(folder: RunFolder, tmp_path: Path) -> None:
    folder.claim("tiny")
    assert folder.manifest() == MANIFEST
    (tmp_path / "empty").mkdir()
    RunFolder(tmp_path / "empty").claim("tiny")


def test_claim__another_campaigns_is_refused_untouched(folder: RunFolder) -> None:
    problem = problem_of(lambda: folder.claim("merge"))
    assert problem.startswith(
        f"{folder.path}: belongs to campaign 'tiny', not 'merge' (choose another folder with --out"
    )
    assert folder.manifest() == MANIFEST


@pytest.mark.parametrize("quick", [False, True])
def test_claim__a_full_run_and_a_quick_one_do_not_overwrite_each_other(quick: bool, folder: RunFolder) -> None:
    folder.write_manifest({**MANIFEST, "quick": not quick})
    assert "would overwrite" in problem_of(lambda: folder.claim("tiny", quick))
    folder.claim("tiny", not quick)


@pytest.mark.parametrize(
    ("name", "message"),
    [(".", "not empty"), ("file", "is a file"), ("file/inside", "can't be written"), ("x" * 300, "can't be written")],
)
def test_claim__what_is_no_run_folder_is_refused_untouched(name: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    assert message in problem_of(lambda: RunFolder(tmp_path / name).claim("tiny"))
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


# --- the manifest -----------------------------------------------------------------------------------------------------


def changed(**changes: Any) -> str:
    return json.dumps({**MANIFEST, **changes})


@pytest.mark.parametrize(
    "content",
    ["", "\0" * 100, changed()[:-20], "[]", "[" * 100_000, changed(stages={"../x-seed1": {}}), changed(versions={})],
)
def test_manifest__a_damaged_one_is_named_and_left_as_it_is(content: str, folder: RunFolder) -> None:
    folder.manifest_file.write_text(content)
    problem = problem_of(folder.manifest)
    assert problem.startswith(str(folder.manifest_file))
    assert "damaged" in problem
    assert problem_of(lambda: folder.claim("tiny")) == problem
    assert folder.manifest_file.read_text() == content


def test_manifest__of_another_format_is_refused_in_one_line(folder: RunFolder) -> None:
    folder.manifest_file.write_text(changed(format=FORMAT + 1, campaign=None))
    problem = problem_of(folder.manifest)
    assert "\n" not in problem
    assert (
        f"format: the run folder has format {FORMAT + 1}, this version of the harness reads format {FORMAT}" in problem
    )
    assert "run the campaign again into another folder, with --out" in problem


@pytest.mark.parametrize("name", [".", "nowhere", "file"])
def test_manifest__of_no_run_folder(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    assert "is not a run folder" in problem_of(RunFolder(tmp_path / name).manifest)


# --- results ----------------------------------------------------------------------------------------------------------


def test_result__is_read_only_as_it_was_written_beside_its_manifest(folder: RunFolder) -> None:
    table = folder.path / "summary.csv"
    assert "has no results: its campaign has not ended" in problem_of(lambda: folder.result("summary.csv"))
    table.write_bytes(b"arm\n")
    write_checksums(folder.results, folder.path, [table, folder.manifest_file], {})
    assert folder.result("summary.csv") == table
    (folder.path / "causes.csv").write_bytes(b"arm\n")  # the results did not have it
    table.write_bytes(b"arm,\n")
    for name in ("summary.csv", "causes.csv", "gone.csv"):
        said = problem_of(partial(folder.result, name))
        assert said.startswith(f"{folder.path / name}: is missing, or is not what the campaign wrote (")
        assert f"harness report {folder.path}" in said
    folder.check_whole(folder.manifest())
    folder.write_manifest({**MANIFEST, "seeds": [1, 2]})  # as a campaign that goes on
    said = problem_of(lambda: folder.result("summary.csv"))
    assert said.startswith(f"{folder.manifest_file}: is missing, or is not what the campaign wrote (")
    folder.check_whole(folder.manifest())


def test_result__of_a_published_folder_is_not_checked(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.write_manifest(MANIFEST)
    assert folder.is_published
    assert folder.result("summary.csv") == tmp_path / "summary.csv"


# --- stages -----------------------------------------------------------------------------------------------------------


def test_finished__only_with_the_key_of_these_inputs(folder: RunFolder) -> None:
    assert folder.finished("naive-seed1", "key") is None
    folder.work("naive-seed1").mkdir()
    assert folder.finished("naive-seed1", "key") is None
    policy = folder.policy("naive-seed1") / "policy.safetensors"
    policy.parent.mkdir()
    policy.touch()
    folder.finish("naive-seed1", "key", {"steps": 7}, [policy])
    assert folder.finished("naive-seed1", "key") == {"steps": 7}
    assert folder.finished("naive-seed1", "another") is None
    assert folder.finished("speedy-seed1", "key") is None
    policy.unlink()
    assert folder.finished("naive-seed1", "key") is None


@pytest.mark.parametrize("content", ["", "[]", "7", '{"key": "key"', '{"info": {}}', "\udcff"])
def test_finished__what_can_not_be_read_is_not_done(content: str, folder: RunFolder) -> None:
    folder.work("naive-seed1").mkdir()
    (folder.work("naive-seed1") / "done.json").write_bytes(content.encode(errors="surrogateescape"))
    assert folder.finished("naive-seed1", "key") is None


def test_forget__drops_what_the_stage_wrote_and_nothing_else(folder: RunFolder) -> None:
    for stage_id in ("naive-seed1", "naive-seed10"):
        for place in (folder.work(stage_id), folder.policy(stage_id), folder.tensorboard(stage_id)):
            place.mkdir()
            (place / "file").write_text("x")
        folder.traces(stage_id).write_text("x")
    folder.forget("naive-seed1")
    left = {path.relative_to(folder.path).as_posix() for path in folder.path.rglob("*") if path.is_file()}
    assert left == {
        "manifest.json",
        ".stages/naive-seed10/file",
        "policies/naive-seed10/file",
        "tensorboard/naive-seed10/file",
        "traces/naive-seed10.parquet",
    }
    folder.forget("naive-seed1")  # twice is once


def test_keep_scene__copies_and_replaces(folder: RunFolder, tmp_path: Path) -> None:
    scene = tmp_path / "scene"
    scene.mkdir()
    for text in ("old", "new"):
        (scene / "scene.toml").write_text(text)
        folder.keep_scene(scene, ("scene.toml",))
        assert (folder.scene / "scene.toml").read_text() == text
