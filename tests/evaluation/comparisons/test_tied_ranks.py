"""Ranks of egos by the games that all of them played."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
import pytest

from harness.evaluation.comparisons.tied_ranks import league_ranks

SIGNIFICANCE = 0.01


def games(ego: str, failed: Sequence[int], first: int = 0, shield: str = "") -> pd.DataFrame:
    """Games of an ego against one person, from this episode on: 1 where it fails."""
    played = {"games_sha256": "a1", "ego": ego, "shield": shield}
    return pd.DataFrame([{**played, "episode": first + k, "ego_failed": each} for k, each in enumerate(failed)])


def ranks(*each: pd.DataFrame) -> dict[str, int]:
    table = league_ranks(pd.concat(each, ignore_index=True), SIGNIFICANCE)
    return dict(zip(table["ego"], table["rank"].tolist(), strict=True))


def test_rank__counts_the_egos_that_fail_significantly_less_often() -> None:
    """12 pairs of which all differ in one direction: p = 2 / 2**12, times 3 pairs of egos, is below 0.01."""
    good, alike, bad = [0] * 20, [1, 0] + [0] * 18, [1] * 12 + [0] * 8
    assert ranks(games("bad", bad), games("good", good), games("alike", alike)) == {"good": 1, "alike": 1, "bad": 3}


def test_rank__egos_that_can_not_be_told_apart_share_one() -> None:
    """4 pairs in one direction: p = 2 / 2**4 is above 0.01."""
    assert ranks(games("a", [1] * 4 + [0] * 16), games("b", [0] * 20)) == {"b": 1, "a": 1}


def test_rank__between_two_that_differ_an_ego_may_be_told_apart_from_neither() -> None:
    good, middle, bad = [0] * 20, [1] * 7 + [0] * 13, [1] * 14 + [0] * 6
    table = league_ranks(pd.concat([games("g", good), games("m", middle), games("b", bad)]), SIGNIFICANCE)
    assert dict(zip(table["ego"], table["rank"].tolist(), strict=True)) == {"g": 1, "m": 1, "b": 2}
    assert dict(zip(table["ego"], table["told_apart"], strict=True)) == {"g": "b", "m": "", "b": "g"}


def test_rank__an_ego_with_its_shield_is_another_one() -> None:
    """A name says nothing about a shield, whatever words it has."""
    of_both = [games("a with shield", [1] * 20), games("a with shield", [0] * 20, shield="rss")]
    table = league_ranks(pd.concat(of_both, ignore_index=True), SIGNIFICANCE)
    assert table["ego"].tolist() == ["a with shield"] * 2
    assert table["shield"].tolist() == ["rss", ""]
    assert table["rank"].tolist() == [1, 2]
    assert table["told_apart"].tolist() == ["a with shield", "a with shield with shield rss"]


def test_ranks__only_games_count_that_every_ego_played() -> None:
    table = league_ranks(pd.concat([games("a", [1, 1, 0, 0]), games("b", [0, 0, 0], first=2)]), SIGNIFICANCE)
    assert table["games"].tolist() == [2, 2]
    assert table.set_index("ego")["games_left_out"].to_dict() == {"a": 2, "b": 1}
    assert table["failure_rate"].tolist() == [0.0, 0.0]


def test_ranks__games_of_other_people_are_others() -> None:
    """Leagues of before and after a change of the scene or its people share no game."""
    changed = games("b", [0, 0]).assign(games_sha256="b2")
    assert league_ranks(pd.concat([games("a", [1, 1]), changed]), SIGNIFICANCE)["games"].tolist() == [0, 0]


def test_ranks__two_games_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match="duplicate"):
        ranks(games("a", [1, 0]), games("a", [0]), games("b", [0, 0]))
