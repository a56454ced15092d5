"""The scripts behind docs/reproduction.md: what they count, and that the page shows what they wrote."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest

from harness.campaign.preflight import open_campaign
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from tests.support.repository import REPOSITORY

FOLDER = REPOSITORY / "docs" / "reproduction"
PAGE = REPOSITORY / "docs" / "reproduction.md"


def script(name: str) -> ModuleType:
    """A script of the folder, as a module."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


findings, sweep = script("findings"), script("sweep")

# --- findings ---------------------------------------------------------------------------------------------------------


def game(arm: str, failed: Any, speed: float = 10.0, non_ego: str = "goal", error: str | None = None) -> dict[str, Any]:
    return {
        "arm": arm,
        "ego_failed": failed,
        "ego_mean_speed_mps": speed,
        "non_ego_outcome": non_ego,
        "non_ego_mean_speed_mps": 15.0,
        "non_ego_payoff": 3.0,
        "error": error,
    }


GAMES = [
    *[game("naive_alone", False, 10.0)] * 4,
    *[game("naive_vs_speedy", failed, 9.0, "collision" if failed else "goal") for failed in (True, True, False, False)],
    game("naive_vs_speedy", None, float("nan"), "error", "the simulator died"),
    *[game("retrained_vs_speedy", False, 9.4)] * 4,
]


def found(what: str) -> tuple[float, bool]:
    """What a row of the table comes to in `GAMES`, and whether it is as it was to be."""
    rows = pd.DataFrame([{"question": "RQ1", "persona": "speedy", "metric": "failure", "p_value": 0.02, "p_holm": 0.1}])
    tables = findings.Tables(pd.DataFrame(GAMES), rows, lawful_payoff=1.0, limit_mps=12.5)
    finding = next(each for each in findings.findings() if each.what == what)
    value = finding.value(tables)
    return value, finding.holds(value)


@pytest.mark.parametrize(
    ("what", "value", "holds"),
    [
        ("naive_alone: failures", 0.0, True),
        ("naive_vs_speedy: failures", 0.5, True),  # the game that could not be played is none of the four
        ("naive_vs_speedy: speed against naive_alone", -0.1, True),
        ("retrained_vs_speedy: speed against naive_alone", -0.06, False),
        ("naive_vs_speedy: its payoff less a law-abiding driver's", 2.0, True),
        ("RQ1 speedy: p of failure", 0.02, False),
        ("RQ1 speedy: Holm-corrected p of failure", 0.1, False),
    ],
)
def test_finding__is_worked_out_from_the_games_that_were_played(what: str, value: float, holds: bool) -> None:
    assert found(what) == (pytest.approx(value), holds)


def test_finding__a_goal_rate_counts_a_game_that_was_not_played_as_not_reached() -> None:
    assert found("naive_vs_speedy: its own goal") == (pytest.approx(0.4), False)


def test_page__shows_the_findings_that_are_kept_beside_it() -> None:
    kept = pd.read_csv(FOLDER / "findings.csv").set_index("what")
    shown = {cells[0]: cells[1:] for cells in rows_of(PAGE) if cells[0] in kept.index}
    assert set(shown) == set(kept.index) == {each.what for each in findings.findings()}
    for each in findings.findings():
        row = kept.loc[each.what]
        seeds = [each.form.format(row[name]) for name in kept.columns if name.startswith("seed_")]
        assert shown[each.what] == [each.bound, *seeds, f"{row['held']} of {len(seeds)}"], each.what
        assert row["held"] == sum(each.holds(row[name]) for name in kept.columns if name.startswith("seed_"))


def rows_of(page: Path) -> list[list[str]]:
    """The cells of every row of every table of a Markdown page."""
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


# --- the sweep --------------------------------------------------------------------------------------------------------


def levers() -> list[Any]:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    return [sweep.Setting(lever, value) for lever in document.levers for value in lever.values]


@pytest.mark.parametrize("setting", levers(), ids=lambda setting: setting.name)
def test_sweep__every_setting_is_a_campaign_that_differs_by_its_one_key(setting: Any, tmp_path: Path) -> None:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    campaign = open_campaign(sweep._write_campaign(FOLDER, document, setting, tmp_path / "documents"))
    shipped = FOLDER / document.campaign
    was = flat(read_document(shipped, Campaign), "campaign.")
    was |= flat(read_document(shipped.parent / "../personas/careful.toml", Persona), "ego.")
    was |= flat(read_document(FOLDER / setting.lever.persona, Persona), "")
    now = flat(campaign.document, "campaign.") | flat(campaign.ego_persona, "ego.") | flat(campaign.personas[0], "")
    kept = {"campaign.name", "campaign.scene", "campaign.ego.persona", "campaign.training.steps"}
    changed = {key for key in was | now if was.get(key) != now.get(key)} - kept
    assert {key.split("[")[0] for key in changed} - {"campaign.personas"} <= {setting.lever.key}
    assert now[setting.lever.key] == setting.value
    assert now["campaign.training.steps"] == document.steps


def flat(document: Any, prefix: str) -> dict[str, Any]:
    """Every plain value of a document by its dotted key."""

    def walk(key: str, value: Any) -> dict[str, Any]:
        if isinstance(value, dict):
            return {k: v for name, each in value.items() for k, v in walk(f"{key}.{name}", each).items()}
        return {key: value}

    dumped = document.model_dump(mode="json")
    return {k: v for name, each in dumped.items() for k, v in walk(f"{prefix}{name}", each).items()}


def test_sweep__its_table_has_every_setting(tmp_path: Path) -> None:
    kept = pd.read_csv(FOLDER / "levers.csv", dtype=str)
    have = set(kept[["persona", "key", "value"]].itertuples(index=False, name=None))
    assert have == {(Path(each.lever.persona).stem, each.lever.key, str(each.value)) for each in levers()}
