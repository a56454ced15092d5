from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.evaluation.game_theory import nash
from harness.evaluation.game_theory.nash import (
    LP_ACCURACY,
    TOLERANCE,
    VALUE_ACCURACY,
    regrets,
    solve,
)

PENNIES = np.array([[1, -1], [-1, 1]])
SEXES = np.array([[3, 0], [0, 2]]), np.array([[2, 0], [0, 3]])
STAKE = np.array([[0, -1, 2], [1, 0, -1], [-2, 1, 0]])


def found(ego, non_ego):
    """(ego shares, non-ego shares) of every equilibrium, in the order they are returned."""
    return [(each.ego_shares.tolist(), each.non_ego_shares.tolist()) for each in solve(ego, non_ego)]


# --- games solved on paper ---


BY_HAND = {
    "matching pennies": (PENNIES, -PENNIES, [([0.5, 0.5], [0.5, 0.5])]),
    "both prisoners defect": ([[3, 0], [5, 1]], [[3, 5], [0, 1]], [([0, 1], [0, 1])]),
    # battle of the sexes: the other player is indifferent when 2 x = 3 (1 - x), so x = 3/5; 3 y = 2 (1 - y), y = 2/5;
    # the ego's payoff is 3, 2 and 6/5: the chosen one comes first
    "two pure and a mixed one": (*SEXES, [([1, 0], [1, 0]), ([0, 1], [0, 1]), ([0.6, 0.4], [0.4, 0.6])]),
    # rock against scissors is worth 2: with shares rock 1/4, paper 1/2, scissors 1/4 every response is worth 0
    "a larger stake": (STAKE, -STAKE, [([0.25, 0.5, 0.25], [0.25, 0.5, 0.25])]),
    # row 1 is better than row 2 everywhere; without row 2 column 1 is better than column 0; then row 0 is best
    "dominated strategies": ([[4, 3], [3, 1], [0, 0]], [[1, 2], [0, 1], [9, 0]], [([1, 0, 0], [0, 1])]),
}


@pytest.mark.parametrize(("ego", "non_ego", "equilibria"), BY_HAND.values(), ids=BY_HAND)
def test_solve__games_solved_on_paper(ego, non_ego, equilibria):
    near = [(pytest.approx(x, abs=1e-9), pytest.approx(y, abs=1e-9)) for x, y in equilibria]
    assert found(np.array(ego), np.array(non_ego)) == near


def test_constant_game__every_profile_is_an_equilibrium_and_the_first_is_chosen():
    same = np.full((2, 3), 7.0)
    pure = [(x.tolist(), y.tolist()) for x in np.eye(2) for y in np.eye(3)]
    assert [each for each in found(same, same) if each in pure] == pure
    x, y = solve(same, same)[0]
    assert (x.tolist(), y.tolist()) == ([1, 0], [1, 0, 0])


def test_degenerate_game__equilibria_with_supports_of_unequal_size_are_found():
    # the non-ego's columns tie when the ego plays its first row alone, which is a best response while 2 y1 <= 1
    equilibria = found(np.array([[1, 1], [0, 2]]), np.array([[3, 3], [1, 0]]))
    assert ([1, 0], [1, 0]) in equilibria
    assert (pytest.approx([1, 0], abs=1e-9), pytest.approx([0.5, 0.5], abs=1e-9)) in equilibria


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("offset", [-1e4, 0.0, 1e4])
def test_equilibria__do_not_depend_on_the_unit_or_zero_of_payoffs(scale, offset):
    if scale == 1e-6:
        offset *= scale  # a larger offset would round the payoffs away
    first = found(*SEXES)
    moved = found(SEXES[0] * scale + offset, SEXES[1] * scale - offset)
    assert np.array(moved) == pytest.approx(np.array(first), abs=1e-6)


# --- properties of any game ---

sizes = st.tuples(st.integers(1, 4), st.integers(1, 4))


@st.composite
def games(draw):
    """Two matrices of one shape: of few numbers, so that ties are frequent, or of any numbers."""
    numbers = draw(st.sampled_from([st.integers(-1, 1).map(float), st.floats(-50, 50, width=32)]))
    shape = draw(sizes)
    return tuple(draw(arrays(np.float64, shape, elements=numbers)) for _ in range(2))


BARELY = np.zeros((2, 3)), np.array([[6.617499e-06, -36.0, 0.0], [0.0, 29.0, 0.0]])
"""A game with a pure profile whose regret is 1.018e-7 of the range, between `TOLERANCE` and what is verified."""


@settings(deadline=None, max_examples=60)
@given(games())
@example(BARELY)
def test_solve__finds_an_equilibrium_and_no_equilibrium_has_a_regret(game):
    solution = solve(*game)
    assert solution
    for each in solution:
        for shares, length in ((each.ego_shares, game[0].shape[0]), (each.non_ego_shares, game[0].shape[1])):
            assert shares.shape == (length,)
            assert (shares >= 0).all()
            assert shares.sum() == pytest.approx(1)
        for regret, payoffs in zip(regrets(*game, each), game, strict=True):
            verified = TOLERANCE + 2.0 * LP_ACCURACY
            assert regret <= verified * np.ptp(payoffs) + 1e-14 * np.abs(payoffs).max()


@settings(deadline=None, max_examples=25)
@given(games())
def test_solve__begins_with_the_highest_ego_payoff_and_always_with_the_same(game):
    x, y = solve(*game)[0]
    best = max(each.ego_shares @ game[0] @ each.non_ego_shares for each in solve(*game))
    assert x @ game[0] @ y == pytest.approx(best, abs=1e-5 * max(np.ptp(game[0]), 1e-9))
    again = solve(*game)[0]
    assert (again[0].tolist(), again[1].tolist()) == (x.tolist(), y.tolist())


def game_of(ego, non_ego):
    """Two matrices of floats."""
    return np.array(ego, dtype=float), np.array(non_ego, dtype=float)


NEAR = 2.0**-24
"""A near-tie of 6e-8: finer than `TOLERANCE`, so that the profile with this regret counts as an equilibrium."""


@settings(deadline=None, max_examples=25)
@given(games())
# a near-tie within `TOLERANCE`: the profile of the highest payoff has a regret of 6e-8
@example(game_of([[0, 1, 0], [1, NEAR, -1]], [[0, -1, 1], [0, 0, NEAR]]))
# near-ties finer than the constraints of HiGHS: its solution does not verify, or it finds none
@example(game_of([[0, 1], [0, 1 - 1.6e-6], [-1, -1]], [[0, -1], [-1, 0], [0, 0]]))
@example(game_of([[1 - 7.4e-6, 1], [-1, 1]], [[-1, 0], [1 + 9.7e-7, 1]]))
@example(game_of([[-1, 1], [0, 1], [-1, -1], [1 - 3.5e-8, 1]], [[0, -1], [-1.7e-9, 1], [1, -1], [-1, 0]]))
@example(game_of([[-1, 0, 0], [1 - 8.6e-7, 1, 1], [-1, 1, 1]], [[-1, -1.3e-7, 0], [-1, 1, 0], [1, 0, 0]]))
# a constant ego payoff: every equilibrium has the same payoff, up to rounding
@example(game_of([[1, 1]] * 4, [[-26, 0], [27, -32], [-32, -32], [-32, -32]]))
def test_the_integer_program__finds_an_equilibrium_by_itself(game):
    """Its ego payoff is the highest of all equilibria that `solve` finds, to `VALUE_ACCURACY` of the range."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nash, "MOST_SUPPORTS", 0)
        patch.setattr(nash, "_pure", lambda shape: iter(()))
        solution = solve(*game)
    assert solution
    best = max(each.ego_shares @ game[0] @ each.non_ego_shares for each in solution)
    highest = max(each.ego_shares @ game[0] @ each.non_ego_shares for each in solve(*game))
    rounding = 1e-14 * np.abs(game[0]).max()
    assert best >= highest - 1.1 * VALUE_ACCURACY * np.ptp(game[0]) - rounding


# --- errors ---


def test_solve__does_not_return_a_candidate_that_does_not_verify(monkeypatch):
    no_equilibrium = iter([(np.array([1.0, 0.0]), np.array([1.0, 0.0]))])
    monkeypatch.setattr(nash, "_by_supports", lambda *game: no_equilibrium)
    for name in ("_by_vertices", "_by_integer_program"):
        monkeypatch.setattr(nash, name, lambda *game: iter([(np.array([np.nan, 0.0]), np.array([0.0, 0.0]))]))
    assert solve(PENNIES, -PENNIES) == []


@pytest.mark.parametrize(
    ("ego", "non_ego"),
    [
        (np.array([[1.0, np.nan]]), np.zeros((1, 2))),
        (np.zeros((1, 2)), np.array([[1.0, np.inf]])),
        (np.zeros((2, 2)), np.zeros((2, 3))),
        (np.zeros((0, 2)), np.zeros((0, 2))),
        (np.zeros(2), np.zeros(2)),
    ],
)
def test_solve__refuses_missing_payoffs_and_matrices_that_are_not_a_game(ego, non_ego):
    with pytest.raises(ValueError, match=r"payoff is missing|one shape"):
        solve(ego, non_ego)
