"""Results that are there are not made again; results that are missing, damaged or of other inputs are."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from harness.campaign.execution.run_campaign import NOTHING_TO_DO, run_campaign
from harness.campaign.preflight import open_campaign
from harness.campaign.results import kept_results
from harness.campaign.results.kept_results import kept_result
from harness.campaign.storage.run_folder import RunFolder
from tests.support.tiny import BY_SUMO, sumo_run, write_campaign


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    """A copy of a finished run."""
    return RunFolder(Path(shutil.copytree(sumo_run(), tmp_path / "run")))


def results_of(folder: RunFolder) -> dict[str, bytes]:
    files = [*folder.path.glob("*.csv"), folder.path / "report.html", *folder.replays.rglob("*.*")]
    files += folder.path.glob("policies/*/README.md")
    return {file.relative_to(folder.path).as_posix(): file.read_bytes() for file in files if file.is_file()}


def a_replay(folder: RunFolder) -> Path:
    return min(folder.replays.rglob("episode.fcd.xml"))


def resume(folder: RunFolder) -> str:
    """Run the campaign of the folder again; what it says."""
    said = io.StringIO()
    campaign = open_campaign(write_campaign(folder.path.parent, **BY_SUMO))
    run_campaign(campaign, folder, 1, Console(file=said, width=200))
    return said.getvalue()


DAMAGES: dict[str, Callable[[RunFolder], object]] = {
    "a report that is missing": lambda folder: (folder.path / "report.html").unlink(),
    "a model card that is missing": lambda folder: (folder.policy("speedy-seed1") / "README.md").unlink(),
    "a table that was edited": lambda folder: (folder.path / "summary.csv").write_bytes(b"arm\n"),
    "a replay that is missing": lambda folder: shutil.rmtree(a_replay(folder).parent),
    "a recording that was cut off": lambda folder: a_replay(folder).write_bytes(a_replay(folder).read_bytes()[:50]),
    "a replay that nothing wrote": lambda folder: shutil.copytree(
        a_replay(folder).parent, folder.replays / "naive_alone-seed9-0"
    ),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_kept_result__is_none_for(damage: Callable[[RunFolder], object], folder: RunFolder) -> None:
    manifest = folder.manifest()
    assert kept_result(folder, manifest) is not None
    damage(folder)
    assert kept_result(folder, manifest) is None


def test_resume__makes_damaged_results_anew_and_nothing_that_is_whole(folder: RunFolder) -> None:
    before = results_of(folder)
    for damage in DAMAGES.values():
        damage(folder)
    assert NOTHING_TO_DO not in resume(folder)
    assert results_of(folder) == before
    times = {name: (folder.path / name).stat().st_mtime_ns for name in before}
    assert resume(folder).strip() == NOTHING_TO_DO
    assert {name: (folder.path / name).stat().st_mtime_ns for name in before} == times


def test_kept_result__is_none_for_another_manifest_program_or_stage(
    folder: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = folder.manifest()
    assert kept_result(folder, {**manifest, "versions": {**manifest["versions"], "numpy": "0"}}) is None
    with monkeypatch.context() as patch:
        patch.setattr(kept_results, "digest_of_sources", lambda: "another")
        assert kept_result(folder, manifest) is None
    assert kept_result(folder, manifest) is not None
    record = folder.work("naive_vs_sumo-seed1") / "done.json"
    record.write_text(record.read_text(encoding="utf-8").replace('"sha256": "', '"sha256": "0'), encoding="utf-8")
    assert kept_result(folder, manifest) is None


def test_kept_result__never_puts_control_characters_on_the_terminal(folder: RunFolder) -> None:
    file, manifest = folder.path / ".stages" / "results.json", folder.manifest()
    kept = kept_result(folder, manifest)
    assert kept is not None
    line = kept.lines[0].text
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace(f'"text": "{line}"', '"text": "\\u001b[2J"'), encoding="utf-8")
    assert kept_result(folder, manifest) is None
