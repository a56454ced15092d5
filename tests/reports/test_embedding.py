from __future__ import annotations

import base64
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest

from harness.reports.embedding import COLUMNS, NOTHING, columns_of, embedded_games, key, pack
from tests.support.pages import campaign
from tests.support.recorded import recorded


@pytest.fixture(scope="module")
def games():
    return list(recorded(campaign(personas=["speedy"])["episodes"]))


def test_packing__of_differences_in_variable_length():
    """Second differences of 0, 1, 2, 10 are 0, 1, 0, 7; zigzag doubles them. 100,000 takes three bytes."""
    packed = pack([(np.array([0, 1, 2, 10]), 2), (np.array([-3, 99_997]), 1)])
    written = zlib.decompress(base64.b64decode(packed))
    assert list(written) == [0, 2, 0, 14, 5, *(200_000 & 127 | 128, 200_000 >> 7 & 127 | 128, 200_000 >> 14)]


def test_columns__are_the_trace_to_half_a_unit(games):
    game = next(game for game in games if game.reference is not None)
    columns = [column for column, _ in columns_of(game)]
    ego = game.players[0]
    for column, (name, (unit, _)) in zip(columns, COLUMNS.items(), strict=False):
        values = np.asarray(ego.columns[name], dtype=float)
        measured = np.isfinite(values)
        assert np.abs(column[measured] * unit - values[measured]).max() <= 0.5 * unit + 1e-9
        assert (column[~measured] == NOTHING).all()
    assert len(columns) == len(COLUMNS) * len(game.players) + 4 * len(game.background) + 3 * 2


def test_embedded__as_many_as_fit_and_no_further_game_is_read(games):
    keys = [key(game.arm, game.seed, game.episode) for game in games]
    assert list(embedded_games(games, {}, {}, {}, 10_000_000)) == keys
    one_by_one = iter(games)
    part = embedded_games(one_by_one, {}, {}, {}, 20_000)
    assert 0 < len(part) < len(games)
    assert list(part) == keys[: len(part)]
    assert sum(map(len, part.values())) <= 20_000
    assert len(list(one_by_one)) == len(games) - len(part) - 1


def test_document__names_the_persona_of_each_of_a_crowd(games):
    ego, person = games[0].players[:2]
    people = [replace(person, name=name) for name in ("non_ego", "non_ego_2")]
    game = replace(games[0], persona="rush", players=[ego, *people])
    for crowds, expected in ({"rush": ["speedy", "anna"]}, [None, "speedy", "anna"]), ({}, [None, None, None]):
        (text,) = embedded_games([game], {}, {}, crowds, 10_000_000).values()
        assert [player.get("persona") for player in json.loads(text)["players"]] == expected
