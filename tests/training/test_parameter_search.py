"""The parameter search: the same games for every trial, and the same trials after an interruption."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import harness.training.parameter_search
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.config.training import Reconfiguration
from harness.config.tunable import Tunable
from harness.drivers.car import car_of
from harness.drivers.mixture import Mixture, mixture_of
from harness.drivers.policy_file import LearnedDriver, read_policy
from harness.drivers.protocol import Driver
from harness.errors import StageFailed
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.training.paired_rollouts import PairedRollouts, seeded_starts
from harness.training.parameter_search import SearchSpec, Trial, best, propose, read_trials, run_search, write_trials
from tests.support.external_drivers import document, find
from tests.support.repository import REPOSITORY
from tests.support.rollouts import Steady
from tests.support.shipped import PERSON, POLICIES
from tests.support.tiny import CAREFUL, PAPER_MERGE, PAPER_SPEEDY

SLOW = 'kind = "rules"\nname = "slow"\ndescription = "Drives at half the limit."\n[cruise]\nspeed_share = 0.5\n'
SPEED = '[tunable]\n"cruise.speed_share" = [0.4, 1.1]\n'


@pytest.fixture(scope="module")
def scene() -> OpenScene:
    return open_scene(PAPER_MERGE)


def opponent() -> Mixture:
    policy = read_policy(POLICIES / PERSON)
    return mixture_of(LearnedDriver(policy, sampled=False), read_document(PAPER_SPEEDY, Persona))


def search_of(scene: OpenScene, folder: Path, text: str, **settings: Any) -> SearchSpec:
    external = find(document(folder, text), folder)
    few = {"trials": 5, "games": 6, "games_at_once": 6, **settings}
    return SearchSpec(
        scene=scene,
        driver=external,
        persona=read_document(CAREFUL, Persona),
        people=(opponent(),),
        settings=Reconfiguration(**few),
        parts=("reconfiguration", 1, "test"),
    )


# --- the games ---


class Recording:
    """Drives by `adas.toml`, and records the first observation of each game."""

    takes_over = True

    def __init__(self, scene: OpenScene) -> None:
        rules = find(str(REPOSITORY / "egos" / "adas.toml"), REPOSITORY)
        self._driver = rules.make(car_of(scene.world, EGO), sampled=False)
        self.first: list[FloatArray] = []
        self._new: set[int] = set()

    def reset(self, games: IntArray) -> None:
        self._new |= {*games.tolist()}
        self._driver.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.first += [seen.copy() for game, seen in zip(games, observation, strict=True) if int(game) in self._new]
        self._new -= {*games.tolist()}
        return self._driver.decide(games, observation, noise)


class Watching(Steady):
    """A planner that keeps its pedals, and counts its views and its decisions."""

    history_s = 0.0

    def __init__(self) -> None:
        super().__init__(0.1)
        self.shown = self.decisions = 0

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        self.shown += len(views)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.decisions += len(games)
        return super().decide(games, observation, noise)


def play(
    scene: OpenScene, driver: Driver, other: Mixture | None = None, alone_share: float = 0.3, **changes: Any
) -> Any:
    arguments = {"games": 7, "at_once": 3} | changes
    careful, people = read_document(CAREFUL, Persona), (other or opponent(),)
    starts = seeded_starts(scene, careful, people, alone_share, "test", 1)
    games = PairedRollouts(scene, starts, **arguments)
    try:
        return games.play(driver), games.play(driver)
    finally:
        games.close()


def test_games__have_the_given_number_and_are_reproducible(scene: OpenScene) -> None:
    recording = Recording(scene)
    once, again = play(scene, recording)
    (payoff, failed) = once
    assert payoff.shape == failed.shape == (7,)
    np.testing.assert_array_equal(once, again)
    # three loads of three games; two are dropped
    np.testing.assert_array_equal(recording.first[:9], recording.first[9:])
    assert len(np.unique(np.array(recording.first[:7]), axis=0)) == 7  # all different


def test_games__do_not_depend_on_the_number_at_once(scene: OpenScene) -> None:
    alone, together = (play(scene, Recording(scene), at_once=at_once)[0] for at_once in (1, 7))
    np.testing.assert_allclose(alone, together, atol=1e-4)


def test_games__show_a_planner_what_it_sees_before_each_decision(scene: OpenScene) -> None:
    planner = Watching()
    play(scene, planner)
    assert planner.decisions > 100
    assert planner.shown == planner.decisions


@pytest.mark.parametrize(("share", "opponents"), [(0.0, range(20, 21)), (1.0, range(1)), (0.5, range(4, 17))])
def test_games__are_without_the_opponent_in_their_share(share: float, opponents: range, scene: OpenScene) -> None:
    other = Recording(scene)
    mixture = mixture_of(other, read_document(CAREFUL, Persona))
    play(scene, Recording(scene), mixture, games=20, at_once=20, alone_share=share)
    assert len(other.first) / 2 in opponents  # everything is played twice


# --- proposals ---

TUNABLE = (Tunable("a", 0.0, 1.0), Tunable("b", -10.0, -5.0))


def test_propose__depends_on_the_trials_before_and_the_seed_only() -> None:
    trials: list[Trial] = []
    for number in range(15):
        values = propose(TUNABLE, trials, "test", 1)
        assert values == propose(TUNABLE, trials, "test", 1)
        assert values != propose(TUNABLE, trials, "test", 2)
        assert all(low <= values[key] <= high for key, low, high in TUNABLE)
        assert list(values) == ["a", "b"]
        payoff = None if number == 3 else -abs(values["a"] - 0.25)
        trials.append(Trial(values=values, mean_payoff=payoff, failure_rate=0.0))
    assert len({trial.values["a"] for trial in trials}) == 15


def test_propose__moves_towards_good_values() -> None:
    trials: list[Trial] = []
    for _ in range(40):
        values = propose(TUNABLE, trials, "test", 1)
        payoff = -abs(values["a"] - 0.25) - 0.1 * abs(values["b"] + 9.0)
        trials.append(Trial(values=values, mean_payoff=payoff, failure_rate=0.0))
    first, last = (np.mean([each.mean_payoff for each in some]) for some in (trials[:10], trials[30:]))
    assert last > first
    assert abs(trials[best(trials)].values["a"] - 0.25) < 0.1


def test_best__is_the_first_of_equals_and_has_a_payoff() -> None:
    trials = [Trial(values={}, mean_payoff=payoff, failure_rate=0.0) for payoff in (1.0, None, 3.0, 3.0, 2.0)]
    assert best(trials) == 2
    assert best(trials[:2]) == 0


# --- the search ---


def test_search__finds_the_speed_with_the_best_payoff(scene: OpenScene, tmp_path: Path) -> None:
    """The careful ego loses payoff at half the limit and above the limit: the best speed is near the limit."""
    search = search_of(scene, tmp_path, SLOW + SPEED, trials=16, games=8, games_at_once=8, alone_share=1.0)
    trials = run_search(search, tmp_path / "trials.json")
    assert dict(trials[0].values) == {"cruise.speed_share": 0.5}
    found = trials[best(trials)]
    assert 0.9 < found.values["cruise.speed_share"] < 1.05
    assert found.mean_payoff is not None
    assert trials[0].mean_payoff is not None
    assert found.mean_payoff > trials[0].mean_payoff + 1.0
    of_share = {each.values["cruise.speed_share"]: each.mean_payoff for each in trials}
    assert max(of_share.items(), key=lambda each: each[1])[0] == found.values["cruise.speed_share"]


@pytest.mark.parametrize("stops_at", [[1], [3, 3, 4]])
def test_search__an_interruption_does_not_change_the_trials(
    stops_at: list[int], scene: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = search_of(scene, tmp_path, SLOW + SPEED)
    whole = run_search(search, tmp_path / "whole.json")
    for stop in stops_at:

        def interrupt(trial: int, stop: int = stop) -> None:
            if trial == stop:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_search(search, tmp_path / "stored.json", on_start=interrupt)
        assert len(read_trials(tmp_path / "stored.json")) == stop
    reports: list[tuple[int, int]] = []
    assert run_search(search, tmp_path / "stored.json", lambda *counts: reports.append(counts)) == whole
    assert reports == [(done, 5) for done in range(stops_at[-1], 6)]
    assert (tmp_path / "stored.json").read_bytes() == (tmp_path / "whole.json").read_bytes()
    monkeypatch.setattr(harness.training.parameter_search, "PairedRollouts", None)  # a finished search plays no games
    assert run_search(search, tmp_path / "stored.json") == whole


def test_trials__are_read_back_exactly_or_not_at_all(tmp_path: Path) -> None:
    trials = [
        Trial(values={"a": 0.1 + 0.2}, mean_payoff=1 / 3, failure_rate=0.0),
        Trial(values={"a": 1e-300}, mean_payoff=None, failure_rate=None, error="ValueError: “no”"),
    ]
    stored = tmp_path / "stored.json"
    assert read_trials(stored) == []
    write_trials(trials, stored)
    assert read_trials(stored) == trials
    whole = stored.read_bytes()
    for damaged in (whole[:-20], b"", b"[]", b"null", whole.replace(b"0.3333", b"0.4333"), b"\xff" + whole):
        stored.write_bytes(damaged)
        assert read_trials(stored) == []


class _Failing:
    """An ego that can't be made with some values."""

    def __init__(self, search: SearchSpec, fails: Any) -> None:
        self._driver, self._fails = search.driver, fails
        self.searched, self.numbers = self._driver.searched, self._driver.numbers

    def tuned(self, values: Any) -> Any:
        if self._fails(values):
            raise ValueError("no such driver")
        return self._driver.tuned(values)

    def make(self, *of: Any) -> Driver:
        self.tuned(self.numbers)
        return self._driver.make(*of)


def test_search__a_driver_that_can_not_be_made_is_a_trial_without_payoff(scene: OpenScene, tmp_path: Path) -> None:
    search = search_of(scene, tmp_path, SLOW + SPEED, trials=8)
    fails: Any = _Failing(search, lambda values: values["cruise.speed_share"] > 0.8)
    trials = run_search(replace(search, driver=fails), tmp_path / "stored.json")
    too_fast = [each for each in trials if each.values["cruise.speed_share"] > 0.8]
    assert 0 < len(too_fast) < 7
    assert {(each.mean_payoff, each.error) for each in too_fast} == {(None, "ValueError: no such driver")}
    assert all((each.mean_payoff is None) == (each in too_fast) for each in trials)
    assert trials[best(trials)] not in too_fast


def test_search__fails_if_the_ego_can_not_play_with_its_own_parameters(scene: OpenScene, tmp_path: Path) -> None:
    search = search_of(scene, tmp_path, SLOW + SPEED)
    fails: Any = _Failing(search, lambda values: True)
    with pytest.raises(StageFailed, match="could not play with its own parameters: ValueError: no such driver"):
        run_search(replace(search, driver=fails), tmp_path / "stored.json")
    assert read_trials(tmp_path / "stored.json") == []
