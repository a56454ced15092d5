"""The warning for a run with stages of different versions names the versions."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.storage.run_folder import RunFolder
from harness.reports.provenance import MIXED_VERSIONS, mixed_versions
from tests.support.tiny import harness, sumo_run

NEW, OLD = {"python": "3.11.7", "numpy": "2.2.6"}, {"python": "3.11.7", "numpy": "2.1.0"}


def stages(**made_by: Any) -> dict[str, dict[str, Any]]:
    return {name: {"status": "done", "versions": versions} for name, versions in made_by.items()}


def test_mixed_versions__names_only_the_differences_of_stages_that_are_done() -> None:
    assert mixed_versions({}) == []
    assert mixed_versions(stages(a=[NEW], b=[NEW], search=[{**NEW, "optuna": "5.0.0"}])) == []
    others = {
        "pending": {"status": "pending", "versions": [OLD]},
        "unknown": {"status": "done"},
        "damaged": {"status": "done", "versions": 7},
    }
    assert mixed_versions(stages(a=[NEW]) | others) == []
    assert mixed_versions(stages(a=[NEW], b=[OLD], c=[NEW]) | others) == [
        MIXED_VERSIONS,
        "  by numpy 2.2.6: a, c",
        "  by numpy 2.1.0: b",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["report", "campaign"])
def test_run__that_mixes_versions_warns_on_the_terminal_and_on_the_page(command: str, tmp_path: Path) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "run")
    manifest, done = RunFolder(run).manifest(), json.loads(done_of(run).read_text())
    for entry in (manifest["stages"]["speedy-seed1"], done["info"]):
        entry["versions"][0]["numpy"] = "1.0"
    RunFolder(run).write_manifest(manifest)
    done_of(run).write_text(json.dumps(done))
    RunFolder(run).results.unlink()  # they are of the manifest before
    more = ("report", run) if command == "report" else ("campaign", sumo_run().with_suffix(".toml"), "--out", run)
    done = harness(*more)
    assert done.returncode == 0, done.stderr
    assert "This run mixes versions" in done.stdout
    assert "by numpy 1.0: speedy-seed1" in done.stdout
    page = (run / "report.html").read_text()
    assert 'id="mixed"' in page
    assert "by numpy 1.0: speedy-seed1" in page
    assert 'id="mixed"' not in (sumo_run() / "report.html").read_text()


def done_of(run: Path) -> Path:
    return run / ".stages" / "speedy-seed1" / "done.json"
