"""A driver that decides otherwise when a game is played again is found before a campaign runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.execution import repeat_check
from harness.campaign.execution.repeat_check import varying_drivers
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from tests.support.tiny import CAREFUL, write_campaign

DICE = """
import json, os, sys
for line in sys.stdin:
    message = json.loads(line)
    answer = {"protocol": 2}
    if message["type"] == "decide":
        answer = {"actions": [[int.from_bytes(os.urandom(8), "big") / 2**64, 0.0] for _ in message["games"]]}
    print(json.dumps(answer), flush=True)
"""


@pytest.mark.parametrize("varies", [True, False])
def test_varying_drivers__are_found_once(varies: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "dice.py").write_text(DICE if varies else DICE.replace("os.urandom(8)", "bytes(8)"))
    (tmp_path / "dice.toml").write_text(f'kind = "process"\ncommand = ["{sys.executable}", "dice.py"]\n')
    campaign = write_campaign(tmp_path, ego={"driver": "dice.toml", "persona": str(CAREFUL)})
    opened, folder = open_campaign(campaign, allow_code=True), RunFolder(tmp_path / "run")
    found = varying_drivers(opened, folder)
    assert list(found) == ["dice.toml"] * varies
    assert all("it is not deterministic: in decision 0 of game 0" in each for each in found.values())

    def played_again(*arguments: Any) -> str:
        raise AssertionError("the answer is in the run folder")

    monkeypatch.setattr(repeat_check, "difference_when_repeated", played_again)
    assert varying_drivers(opened, folder) == found
