"""Whatever file of a run folder is torn: it is made again or named, and never read as if it were whole."""

from __future__ import annotations

import io
import json
import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from harness.campaign.results.results import write_results
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from tests.support.tiny import carried_out, learned_run, tables

pytestmark = pytest.mark.slow

WAYS = ("gone", "empty", "half", "zeros")
# What nothing is read from, or what every run and every report writes anew before it reads it.
ANEW = {"report.html", "README.md", "episodes.csv", "summary.csv", "comparisons.csv", "training.csv", "manoeuvres.csv"}


def tear(file: Path, way: str) -> None:
    content = file.read_bytes()
    if way == "gone":
        file.unlink()
    else:
        file.write_bytes({"empty": b"", "half": content[: len(content) // 2], "zeros": bytes(len(content))}[way])


def is_vouched_for(run: Path, file: Path) -> bool:
    """Whether numbers are read from a file when the stages are done."""
    where = file.relative_to(run).parts
    if where[0] == ".stages":
        return file.name in ("done.json", "played.csv", "training.csv")
    return where[0] in ("policies", "traces", "scene") and file.name not in ANEW


def files_of(run: Path) -> Iterator[Path]:
    """All but what SUMO-GUI and TensorBoard are shown."""
    for file in sorted(run.rglob("*")):
        if file.is_file() and file.relative_to(run).parts[0] not in ("replays", "tensorboard"):
            yield file


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shutil.copytree(learned_run(), tmp_path_factory.mktemp("torn") / "run")


def keys_of(run: Path) -> dict[str, str]:
    stages = [each for each in (run / ".stages").iterdir() if "-seed" in each.name]
    return {each.name: (each / "key").read_text() for each in stages}


def test_every_file__torn_in_any_way_is_noticed_where_it_counts(copy: Path) -> None:
    folder, keys, torn = RunFolder(copy), keys_of(copy), 0
    manifest = folder.manifest()
    for file in list(files_of(copy)):
        content, of_scene, counts = file.read_bytes(), "scene" in file.parts, is_vouched_for(copy, file)
        if not content or file.name == "manifest.json":
            continue
        for way in WAYS:
            tear(file, way)
            lost = [stage for stage, key in keys.items() if folder.finished(stage, key) is None]
            if counts and not of_scene:
                assert len(lost) == 1, file  # the stage that made it is done again
                assert lost[0] in (*file.parts, file.stem), file
            else:
                assert lost == [], file
            if not counts:
                folder.check_whole(manifest)
            elif not (of_scene and way == "gone"):  # a scene's file that is gone is missed by who opens the scene
                with pytest.raises(UsageError) as error:
                    folder.check_whole(manifest)
                assert [problem.file for problem in error.value.problems] == [str(file)]
            torn += counts
            file.write_bytes(content)
    assert torn > 100
    folder.check_whole(manifest)


def test_report__of_a_torn_run_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    run = shutil.copytree(learned_run(), tmp_path / "run")
    table = run / ".stages" / "naive_alone-seed1" / "played.csv"
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(lines[:-1]))  # a table still, of a game less
    (run / "episodes.csv").unlink()
    with pytest.raises(UsageError, match="is not what the campaign wrote"):
        write_results(RunFolder(run), Console(file=io.StringIO()))
    assert not (run / "episodes.csv").exists()


def test_campaign__run_again_on_torn_files_ends_as_if_nothing_was(tmp_path: Path) -> None:
    """A tenth of all files at random, the manifest excepted, and every checkpoint: those of trainings too."""
    chance = random.Random(1)
    run = shutil.copytree(learned_run(), tmp_path / "run")
    before = {file: file.read_bytes() for file in files_of(run)}
    for file in before:
        if file.name == "checkpoint.safetensors" or (file.name != "manifest.json" and chance.random() < 0.1):
            tear(file, chance.choice(WAYS))
    carried_out(learned_run().with_suffix(".toml"), run)
    assert tables(run) == tables(learned_run())
    for file, content in before.items():
        if is_vouched_for(run, file) and file.name != "done.json":
            assert file.read_bytes() == content, file
    manifest = json.loads((run / "manifest.json").read_text())
    assert all(stage["status"] == "done" for stage in manifest["stages"].values())
