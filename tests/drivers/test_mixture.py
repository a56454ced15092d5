"""Several drivers for one player: each game has one of them, with its habits and payoff, and chance knows which."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.campaign.results.population_summary import by_who_drove
from harness.config.campaign import Campaign, Population
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import Member, Mixture, mixture_of
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.environments.rollout import Arm, Game, assess
from harness.evaluation.tables import EPISODE_COLUMNS, typed
from harness.game.arrays import FloatArray, IntArray
from harness.game.attention import Attention, HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.traffic.scene import OpenScene, open_scene

TEXTING = HumanFactors(Attention(2.0, (1.0, 2.0), 0.02))


class Steady:
    """Always does the same, and writes down in which games it was asked."""

    takes_over = True

    def __init__(self, pedals: float) -> None:
        self.pedals = pedals
        self.begun: list[int] = []
        self.asked: set[int] = set()

    def reset(self, games: IntArray) -> None:
        self.begun += games.tolist()

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.asked |= set(games.tolist())
        return np.tile([self.pedals, 0.0], (len(games), 1))


@pytest.fixture(scope="module")
def merge(repository: Any) -> OpenScene:
    return open_scene(repository / "tests/data/merge")


@pytest.fixture(scope="module")
def people(repository: Any) -> dict[str, Persona]:
    return {name: read_document(repository / f"personas/{name}.toml", Persona) for name in ("careful", "speedy")}


def mixed_starts(merge: OpenScene, shares: list[float], games: int) -> list[InitialState]:
    start_distribution = merge.start_distribution(
        [HumanFactors(), [HumanFactors(), TEXTING]], [1.0, 1.0], [[1.0], shares]
    )
    return [draw_initial_state(start_distribution, "test", 1, "episode", k) for k in range(games)]


def test_mixture__is_drawn_by_its_shares(merge: OpenScene) -> None:
    drawn = [start.member[1] for start in mixed_starts(merge, [1.0, 3.0], 2000)]
    assert set(drawn) == {0, 1}
    assert np.mean(drawn) == pytest.approx(0.75, abs=4.0 * np.sqrt(0.75 * 0.25 / 2000))


def test_mixture__each_has_its_own_habits(merge: OpenScene) -> None:
    starts = mixed_starts(merge, [1.0, 1.0], 100)
    lapsing = [start.lapses[1].lapsed.any() for start in starts]
    assert not any(lapses for start, lapses in zip(starts, lapsing, strict=True) if start.member[1] == 0)
    assert all(lapses for start, lapses in zip(starts, lapsing, strict=True) if start.member[1] == 1)


def test_mixture__a_game_starts_as_with_one_driver(merge: OpenScene) -> None:
    alone = merge.start_distribution([HumanFactors(), TEXTING], [1.0, 1.0])
    for k, mixed in enumerate(mixed_starts(merge, [1.0, 1.0], 20)):
        one = draw_initial_state(alone, "test", 1, "episode", k)
        for name in ("x_m", "y_m", "heading_rad", "speed_mps", "position_m", "noise", "seed", "present"):
            assert np.array_equal(getattr(one, name), getattr(mixed, name))
        if mixed.member[1] == 1:
            assert np.array_equal(one.lapses[1].lapsed, mixed.lapses[1].lapsed)


def test_arena__asks_in_each_game_the_driver_whose_it_is(merge: OpenScene, people: dict[str, Persona]) -> None:
    slow, fast = Steady(-0.2), Steady(0.5)
    arena = Arena(merge, 8, [Seat(Steady(0.0)), [Seat(slow), Seat(fast)]])
    try:
        starts = dict(enumerate(mixed_starts(merge, [1.0, 1.0], 8)))
        whose = np.array([starts[game].member[1] for game in range(8)])
        assert 0 < whose.sum() < 8
        arena.reset(starts)
        before = arena.state.speed_mps[:, 1].copy()
        arena.step()
        attends = ~arena.state.lapsed[:, 1]
        gained = arena.state.speed_mps[:, 1] - before
        assert (gained[(whose == 1) & attends] > 0.0).all()
        assert (gained[whose == 0] < 0.0).all()
    finally:
        arena.close()
    for driver, member in ((slow, 0), (fast, 1)):
        theirs = set(np.flatnonzero(whose == member).tolist())
        assert set(driver.begun) == theirs
        assert driver.asked == theirs


def records(games: list[Game]) -> list[dict[str, Any]]:
    return [game.record for game in games]


def test_assess__plays_each_episode_as_its_member_alone_would(merge: OpenScene, people: dict[str, Persona]) -> None:
    """Driver, habits and payoff are the member's: the game is that of the arm in which it has the seat alone."""
    careful, speedy = people["careful"], people["speedy"]
    members = (
        Member(driver=Steady(0.1), persona=careful, share=1.0),
        Member(driver=Steady(0.4), persona=speedy, share=1.0),
    )
    mixed = Arm(name="mixed", scene=merge, drivers=(Steady(0.0), Mixture(members)), personas=(careful, careful), seed=1)
    alone = [
        records(
            list(
                assess(
                    Arm(
                        name="alone",
                        scene=merge,
                        drivers=(Steady(0.0), each.driver),
                        personas=(careful, each.persona),
                        seed=1,
                    ),
                    6,
                )
            )
        )
        for each in members
    ]
    start_distribution = merge.start_distribution(
        [HumanFactors(), [each.persona.human_factors for each in members]], [1.0, 1.0], [[1.0], [1.0, 1.0]]
    )
    whose = [draw_initial_state(start_distribution, "assessment", 1, "episode", k).member[1] for k in range(6)]
    assert set(whose) == {0, 1}
    assert records(list(assess(mixed, 6))) == [alone[member][k] for k, member in enumerate(whose)]


def test_mixture__of_one_is_the_driver(people: dict[str, Persona]) -> None:
    driver = Steady(0.0)
    assert mixture_of(driver, people["careful"]).members == (
        Member(driver=driver, persona=people["careful"], share=1.0),
    )


def test_mixture__is_of_drivers_that_a_game_can_have(people: dict[str, Persona]) -> None:
    careful = people["careful"]
    with pytest.raises(ValueError, match="needs members"):
        Mixture(())
    with pytest.raises(ValueError, match="share above 0"):
        Mixture((Member(driver=Steady(0.0), persona=careful, share=0.0),))
    with pytest.raises(ValueError, match="SUMO can't drive a player in some games"):
        Mixture((Member(driver=Steady(0.0), persona=careful), Member(driver=SumoDriver(), persona=careful)))


def test_by_who_drove__is_who_did(merge: OpenScene, people: dict[str, Persona]) -> None:
    """The table says of each game what the draw of its start said, with the failures of those games alone."""
    shares = {"careful": 1.0, "speedy": 1.0}
    members = tuple(Member(driver=Steady(0.2), persona=people[name], share=share) for name, share in shares.items())
    arm = Arm(
        name="naive_vs_town",
        scene=merge,
        drivers=(Steady(0.0), Mixture(members)),
        personas=(people["careful"], people["careful"]),
        seed=3,
    )
    played = pd.DataFrame([{"arm": arm.name, "persona": "town", "seed": 3, **game.record} for game in assess(arm, 8)])
    episodes = typed(played.reindex(columns=list(EPISODE_COLUMNS)))
    campaign = Campaign(name="any", scene="any", personas=["any"], population=[Population(name="town", shares=shares)])
    found = by_who_drove(campaign, episodes).set_index("persona")
    start_distribution = merge.start_distribution(
        [HumanFactors(), [HumanFactors(), HumanFactors()]], [1.0, 1.0], [[1.0], [1.0, 1.0]]
    )
    drove = [
        list(shares)[draw_initial_state(start_distribution, "assessment", 3, "episode", k).member[1]] for k in range(8)
    ]
    assert set(drove) == set(shares)
    for name in shares:
        theirs = episodes[[who == name for who in drove]]
        assert found.loc[name, "episodes"] == len(theirs)
        assert found.loc[name, "failure_rate"] == theirs["ego_failed"].mean()
        assert found.loc[name, "non_ego_payoff"] == pytest.approx(theirs["non_ego_payoff"].mean())
