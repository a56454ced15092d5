"""How long a campaign takes with a driver, by the time of its checked games."""

from __future__ import annotations

from typing import Any

import pytest

from harness.assessment.conformance import Findings
from harness.cli.driver_pace import pace_lines


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.cli.driver_pace.cores", lambda: 2)


def lines(driver: str = "mine.toml", **found: Any) -> list[str]:
    return pace_lines(Findings(**{"game_seconds": [2.0, 4.0], "seconds_at_once": 0.01, **found}), driver)


def test_pace__of_an_arm_and_of_a_campaign_with_one_person() -> None:
    """100 games of 3 s; the ego alone, with SUMO's driver and with the person; half of 3 M steps beside it."""
    assert lines() == [
        "  pace   5 min 00 s for an arm of 100 games in one process",
        "         a campaign with one person: 3 arms 7 min 30 s in as many processes as cores (2); its 1.5 M decisions "
        "in the person's training up to 4 h 10 min",
    ]


def test_pace__a_search_plays_games_too() -> None:
    told = lines(tunable=True)[1]
    assert "5 arms 12 min 30 s" in told
    assert "the search of 2,560 games up to 2 h 08 min" in told


def test_pace__sumos_own_models_make_no_decisions() -> None:
    told = lines("sumo", seconds_at_once=None)[1]
    assert told == "         a campaign with one person: 3 arms 7 min 30 s in as many processes as cores (2)"


def test_pace__more_processes_than_segments_play_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of the 60 segments is five games of 3 s."""
    monkeypatch.setattr("harness.cli.driver_pace.cores", lambda: 64)
    assert "3 arms 15.0 s" in lines()[1]


def test_pace__is_not_told_of_a_driver_that_violates_the_protocol() -> None:
    assert lines(violations=["it modified the observation"]) == []
    assert lines(game_seconds=[]) == []
