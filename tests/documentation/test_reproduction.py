"""The scripts behind docs/reproduction.md: their numbers, and that the page shows their output."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.preflight import open_campaign
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

FOLDER = REPOSITORY / "docs" / "reproduction"
PAGE = REPOSITORY / "docs" / "reproduction.md"

findings, sweep = script("reproduction/findings.py"), script("reproduction/sweep.py")

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
    *[
        game("naive_vs_paper_speedy", failed, 9.0, "collision" if failed else "goal")
        for failed in (True, True, False, False)
    ],
    game("naive_vs_paper_speedy", None, float("nan"), "error", "the simulator died"),
    *[game("retrained_vs_paper_speedy", False, 9.4)] * 4,
]


def found_in_games(what: str) -> tuple[float, bool]:
    """The value of a row of the table in `GAMES`, and whether it is as expected."""
    rows = pd.DataFrame(
        [{"question": "RQ1", "persona": "paper_speedy", "metric": "failure", "p_value": 0.02, "p_holm": 0.1}]
    )
    tables = findings.Tables(episodes=pd.DataFrame(GAMES), comparisons=rows, lawful_payoff=1.0, limit_mps=12.5)
    finding = next(each for each in findings.findings() if each.what == what)
    value = finding.value(tables)
    return value, finding.holds(value)


@pytest.mark.parametrize(
    ("what", "value", "holds"),
    [
        ("naive_alone: failures", 0.0, True),
        ("naive_vs_paper_speedy: failures", 0.5, True),  # the game with an error is not one of the four
        ("naive_vs_paper_speedy: speed against naive_alone", -0.1, True),
        ("retrained_vs_paper_speedy: speed against naive_alone", -0.06, False),
        ("naive_vs_paper_speedy: its payoff less a law-abiding driver's", 2.0, True),
        ("RQ1 paper_speedy: p of failure", 0.02, False),
        ("RQ1 paper_speedy: Holm-corrected p of failure", 0.1, False),
    ],
)
def test_finding__is_computed_from_the_games_without_errors(what: str, value: float, holds: bool) -> None:
    assert found_in_games(what) == (pytest.approx(value), holds)


def test_finding__a_goal_rate_counts_a_game_with_an_error_as_not_reached() -> None:
    assert found_in_games("naive_vs_paper_speedy: its own goal") == (pytest.approx(0.4), False)


def test_page__shows_the_stored_findings() -> None:
    stored = pd.read_csv(FOLDER / "findings.csv").set_index("what")
    shown = {cells[0]: cells[1:] for cells in rows_of(PAGE) if cells[0] in stored.index}
    assert set(shown) == set(stored.index) == {each.what for each in findings.findings()}
    for each in findings.findings():
        row = stored.loc[each.what]
        seeds = [each.form.format(row[name]) for name in stored.columns if name.startswith("seed_")]
        assert shown[each.what] == [each.bound, *seeds, f"{row['held']} of {len(seeds)}"], each.what
        assert row["held"] == sum(each.holds(row[name]) for name in stored.columns if name.startswith("seed_"))


def rows_of(page: Path) -> list[list[str]]:
    """The cells of every row of every table of a Markdown page."""
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


# --- the sweep --------------------------------------------------------------------------------------------------------


def levers() -> list[Any]:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    return [sweep.Setting(lever, value) for lever in document.levers for value in lever.values]


@pytest.mark.parametrize("setting", levers(), ids=lambda setting: setting.name)
def test_sweep__each_setting_is_a_campaign_that_differs_in_one_key(setting: Any, tmp_path: Path) -> None:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    campaign = open_campaign(sweep._write_campaign(FOLDER, document, setting, tmp_path / "documents"))
    shipped = FOLDER / document.campaign
    was = flat(read_document(shipped, Campaign), "campaign.")
    was |= flat(read_document(shipped.parent / "../personas/careful.toml", Persona), "ego.")
    was |= flat(read_document(FOLDER / setting.lever.persona, Persona), "")
    now = flat(campaign.document, "campaign.") | flat(campaign.ego_persona, "ego.") | flat(campaign.personas[0], "")
    always_changed = {"campaign.name", "campaign.scene", "campaign.ego.persona", "campaign.training.steps"}
    always_changed.add("campaign.seeds")  # levers are turned on seeds that are not published
    changed = {key for key in was | now if was.get(key) != now.get(key)} - always_changed
    assert {key.split("[")[0] for key in changed} - {"campaign.personas"} <= {setting.lever.key}
    assert now[setting.lever.key] == setting.value
    assert now["campaign.training.steps"] == document.steps


def flat(document: Any, prefix: str) -> dict[str, Any]:
    """All plain values of a document by their dotted keys."""

    def walk(key: str, value: Any) -> dict[str, Any]:
        if isinstance(value, dict):
            return {k: v for name, each in value.items() for k, v in walk(f"{key}.{name}", each).items()}
        return {key: value}

    dumped = document.model_dump(mode="json")
    return {k: v for name, each in dumped.items() for k, v in walk(f"{prefix}{name}", each).items()}


def test_sweep__the_table_has_all_settings(tmp_path: Path) -> None:
    stored = pd.read_csv(FOLDER / "levers.csv", dtype=str)
    settings = set(stored[["persona", "key", "value"]].itertuples(index=False, name=None))
    assert settings == {(Path(each.lever.persona).stem, each.lever.key, str(each.value)) for each in levers()}
