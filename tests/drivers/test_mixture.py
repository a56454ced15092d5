"""Several drivers for one player: each game has one of them, with its human factors and payoff, drawn by shares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.assessment.seated_arm import SeatedArm
from harness.campaign.results.run_people import by_who_drove
from harness.config.campaign import Campaign, Population
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import Member, Mixture, mixture_of
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.evaluation.columns import TABLES
from harness.evaluation.tables import typed
from harness.game.arrays import FloatArray, IntArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.lapses import Attention
from harness.road.scene.open_scene import OpenScene
from tests.support.rollouts import Steady, assess

TEXTING = HumanFactors(attention=Attention(mean_attentive_s=2.0, lapse_s=(1.0, 2.0)))


class Recording(Steady):
    """Records the games of its resets and decisions."""

    def __init__(self, pedals: float) -> None:
        super().__init__(pedals)
        self.reset_games: list[int] = []
        self.decided_games: set[int] = set()

    def reset(self, games: IntArray) -> None:
        self.reset_games += games.tolist()

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.decided_games |= set(games.tolist())
        return super().decide(games, observation, noise)


@pytest.fixture(scope="module")
def people(repository: Any) -> dict[str, Persona]:
    return {name: read_document(repository / f"personas/{name}.toml", Persona) for name in ("careful", "speedy")}


def mixed_starts(merge: OpenScene, shares: list[float], games: int) -> list[InitialState]:
    start_distribution = merge.start_distribution(
        [HumanFactors(), [HumanFactors(), TEXTING]], [1.0, 1.0], [[1.0], shares]
    )
    return [draw_initial_state(start_distribution, "test", 1, "episode", k) for k in range(games)]


def test_mixture__members_are_drawn_by_shares(merge: OpenScene) -> None:
    drawn = [start.member[1] for start in mixed_starts(merge, [1.0, 3.0], 2000)]
    assert set(drawn) == {0, 1}
    assert np.mean(drawn) == pytest.approx(0.75, abs=4.0 * np.sqrt(0.75 * 0.25 / 2000))


def test_mixture__members_have_their_own_human_factors(merge: OpenScene) -> None:
    starts = mixed_starts(merge, [1.0, 1.0], 100)
    lapsing = [start.lapses[1].lapsed.any() for start in starts]
    assert not any(lapses for start, lapses in zip(starts, lapsing, strict=True) if start.member[1] == 0)
    assert all(lapses for start, lapses in zip(starts, lapsing, strict=True) if start.member[1] == 1)


def test_mixture__initial_states_are_those_of_one_driver(merge: OpenScene) -> None:
    alone = merge.start_distribution([HumanFactors(), TEXTING], [1.0, 1.0])
    for k, mixed in enumerate(mixed_starts(merge, [1.0, 1.0], 20)):
        one = draw_initial_state(alone, "test", 1, "episode", k)
        for name in ("x_m", "y_m", "heading_rad", "speed_mps", "position_m", "noise", "seed", "present"):
            assert np.array_equal(getattr(one, name), getattr(mixed, name))
        if mixed.member[1] == 1:
            assert np.array_equal(one.lapses[1].lapsed, mixed.lapses[1].lapsed)


def test_arena__calls_the_member_of_each_game(merge: OpenScene, people: dict[str, Persona]) -> None:
    slow, fast = Recording(-0.2), Recording(0.5)
    arena = Arena(merge, 8, [Seat(Steady(0.0)), [Seat(slow), Seat(fast)]])
    try:
        starts = dict(enumerate(mixed_starts(merge, [1.0, 1.0], 8)))
        member_of = np.array([starts[game].member[1] for game in range(8)])
        assert 0 < member_of.sum() < 8
        arena.reset(starts)
        before = arena.state.speed_mps[:, 1].copy()
        arena.step()
        attends = ~arena.state.lapsed[:, 1]
        gained = arena.state.speed_mps[:, 1] - before
        assert (gained[(member_of == 1) & attends] > 0.0).all()
        assert (gained[member_of == 0] < 0.0).all()
    finally:
        arena.close()
    for driver, member in ((slow, 0), (fast, 1)):
        games_of_member = set(np.flatnonzero(member_of == member).tolist())
        assert set(driver.reset_games) == games_of_member
        assert driver.decided_games == games_of_member


def drawn_members(merge: OpenScene, people: Sequence[Persona], seed: int, games: int) -> list[int]:
    """Which of two people drives in each episode."""
    factors = [[HumanFactors()], [each.human_factors for each in people]]
    starts = merge.start_distribution(factors, [1.0, 1.0], [[1.0], [1.0, 1.0]])
    return [draw_initial_state(starts, "assessment", seed, "episode", k).member[1] for k in range(games)]


def test_assess__an_episode_is_that_of_its_member_alone(merge: OpenScene, people: dict[str, Persona]) -> None:
    """Driver, human factors and payoff are those of the member: the game is that of the arm with this member alone."""
    careful = people["careful"]
    members = [Member(driver=Steady(0.1), persona=careful), Member(driver=Steady(0.4), persona=people["speedy"])]

    def records(other: Mixture) -> list[dict[str, Any]]:
        drivers = (mixture_of(Steady(0.0), careful), other)
        return [game.record for game in assess(SeatedArm(name="any", scene=merge, drivers=drivers, seed=1), range(6))]

    alone = [records(Mixture((each,))) for each in members]
    drove = drawn_members(merge, [each.persona for each in members], 1, 6)
    assert set(drove) == {0, 1}
    assert records(Mixture(tuple(members))) == [alone[member][k] for k, member in enumerate(drove)]


def test_mixture__invalid_members_are_refused(people: dict[str, Persona]) -> None:
    careful = people["careful"]
    with pytest.raises(ValueError, match="needs members"):
        Mixture(())
    with pytest.raises(ValueError, match="share above 0"):
        Mixture((Member(driver=Steady(0.0), persona=careful, share=0.0),))
    with pytest.raises(ValueError, match="SUMO can't drive a player in some games"):
        Mixture((Member(driver=Steady(0.0), persona=careful), Member(driver=SumoDriver(), persona=careful)))


def test_by_who_drove__has_the_members_of_the_games(merge: OpenScene, people: dict[str, Persona]) -> None:
    """Each row has the games in which its member was drawn, and their failures."""
    shares = {"careful": 1.0, "speedy": 1.0}
    members = tuple(Member(driver=Steady(0.2), persona=people[name], share=share) for name, share in shares.items())
    drivers = (mixture_of(Steady(0.0), people["careful"]), Mixture(members))
    arm = SeatedArm(name="naive_vs_town", scene=merge, drivers=drivers, seed=3)
    played = pd.DataFrame(
        [{"arm": arm.name, "persona": "town", "seed": 3, **game.record} for game in assess(arm, range(8))]
    )
    episodes = typed(played.reindex(columns=list(TABLES["episodes"])))
    town = [Population(name="town", shares=shares)]
    campaign = Campaign(name="any", scene="any", personas=["any"], seeds=[3], population=town)
    found = by_who_drove(campaign, episodes).set_index("persona")
    drove = [list(shares)[member] for member in drawn_members(merge, [people[name] for name in shares], 3, 8)]
    assert set(drove) == set(shares)
    for name in shares:
        games_of_member = episodes[[who == name for who in drove]]
        assert found.loc[name, "episodes"] == len(games_of_member)
        assert found.loc[name, "failure_rate"] == games_of_member["ego_failed"].mean()
        assert found.loc[name, "non_ego_payoff"] == pytest.approx(games_of_member["non_ego_payoff"].mean())
