"""Regret as a curriculum: the ego replays the starts in which it earns less than another driver did.

A pool has seeded starts in which the other players take part. Before the training, the reference drivers with a
reaction time and the best known ego drive in all of them, against the people of the training. With their best payoff,
the regret of a start is

    max(0, best payoff - the learner's latest payoff in this start)

by the payoff of the ego's persona. A success has a regret as well, if another driver earns more. A start in which all
of these drivers fail is unpreventable, and is never replayed; games that are drawn anew have such starts as before.
The random numbers of SUMO's own drivers are not those of the first game when a start is replayed.

Which start is replayed follows "Prioritized Level Replay" (M. Jiang, E. Grefenstette, T. Rocktäschel, ICML 2021), with
regret as the score. PAIRED (M. Dennis et al., NeurIPS 2020) takes regret from a learned antagonist, ACCEL (J.
Parker-Holder et al., ICML 2022) from the learner's errors of value.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np

from harness.drivers.protocol import Driver
from harness.drivers.reference_drivers import PERSONS, reference_driver
from harness.game.arrays import BoolArray, FloatArray
from harness.game.initial_state import InitialState
from harness.game.roles import EGO
from harness.game.seeding import generator_of
from harness.training.paired_rollouts import PairedRollouts, SeededStarts, seeded_starts
from harness.training.training_games import TrainingSpec

POOL = 256
"""Starts of the pool. Each of the other drivers plays all of them once, before the training. Chosen here."""
REPLAY_SHARE = 0.5
"""Share of the games beside other players that are replays. The other half are drawn anew, as those of an assessment
are, so that the ego does not learn the pool by heart. Chosen here."""
TEMPERATURE, STALENESS = 0.1, 0.1
"""Beta and rho of Prioritized Level Replay, with the values that the paper uses on Procgen."""


@dataclass(frozen=True, kw_only=True)
class RegretScores:
    """What is known of the N starts of a pool."""

    best_payoffs: list[float]
    """[N] the best payoff of the other drivers."""
    preventable: list[bool]
    """[N] whether one of these drivers reaches its goal."""
    latest_payoffs: list[float | None]
    """[N] the learner's payoff in its latest replay; None: it has played none."""
    last_replays: list[int]
    """[N] the number of the latest replay, of all replays from 1 on; 0: none."""
    replays: int = 0
    """Replays that have ended."""

    @property
    def regrets(self) -> FloatArray:
        """[N] the regrets; infinite where the learner has played no replay."""
        latest = np.array([-np.inf if each is None else each for each in self.latest_payoffs], dtype=float)
        return np.maximum(0.0, np.array(self.best_payoffs) - latest)

    @property
    def mean_regret(self) -> float | None:
        """The mean over the preventable starts that the learner has played; None without any."""
        regrets = self.regrets[np.array(self.preventable, dtype=bool)]
        played = regrets[np.isfinite(regrets)]
        return float(played.mean()) if len(played) else None

    def after(self, start: int, payoff: float) -> RegretScores:
        """The scores after a replay of a start, which earned the learner this payoff."""
        latest, last, replays = list(self.latest_payoffs), list(self.last_replays), self.replays + 1
        latest[start], last[start] = payoff, replays
        return replace(self, latest_payoffs=latest, last_replays=last, replays=replays)


def scores_of(payoffs: FloatArray, failed: BoolArray) -> RegretScores:
    """The scores of a pool before the training, from the payoffs [D, N] of D drivers in its starts, and whether they
    failed [D, N]."""
    starts = payoffs.shape[1]
    return RegretScores(
        best_payoffs=payoffs.max(axis=0).tolist(),
        preventable=[not of_start.all() for of_start in failed.T],
        latest_payoffs=[None] * starts,
        last_replays=[0] * starts,
    )


def replay_weights(regrets: FloatArray, ages: FloatArray) -> FloatArray:
    """[N] the probability of each start to be the next replay, from regrets [N] and `ages` [N]: the replays of other
    starts since its own latest one.

    (1 - rho) h^(1/beta) / sum + rho age / sum, with h = 1 / rank of the regret (Jiang et al., section 3). Equal regrets
    share the least rank, so that all starts without a replay are equally probable.

    >>> replay_weights(np.array([2.0, np.inf, np.inf]), np.array([0.0, 1.0, 1.0])).round(4)
    array([0. , 0.5, 0.5])
    """
    ranks = 1.0 + (regrets > regrets[:, np.newaxis]).sum(axis=1)
    by_regret = ranks ** (-1.0 / TEMPERATURE)
    by_regret /= by_regret.sum()
    return (1.0 - STALENESS) * by_regret + STALENESS * ages / ages.sum() if ages.any() else by_regret


class RegretReplays:
    """Replays for the games of an arena, as `environments.auto_reset.Replays`.

    A start that is being played is not drawn again: its regret is known at the end of the game. Without this, most
    games that run in parallel would be the same one.
    """

    def __init__(self, starts: SeededStarts, scores: RegretScores) -> None:
        """`starts` are those of the pool, `scores` those before the next game."""
        self._starts, self.scores = starts, scores
        self._running: dict[int, int] = {}

    def replay(self, tile: int, drawn: InitialState) -> InitialState | None:
        """The start that a tile plays instead of the drawn one; None: that one."""
        scores, running = self.scores, set(self._running.values())
        free = [start for start, there in enumerate(scores.preventable) if there and start not in running]
        generator = generator_of(*drawn.parts, "replay")
        if not free or drawn.present.sum() < 2 or generator.random() >= REPLAY_SHARE:
            return None
        ages = scores.replays - np.array(scores.last_replays, dtype=float)
        start = free[generator.choice(len(free), p=replay_weights(scores.regrets[free], ages[free]))]
        self._running[tile] = start
        return self._starts.start(start)

    def ended(self, tile: int, payoff: float) -> None:
        """Enter the learner's payoff in the game of a tile that has ended, if it was a replay."""
        start = self._running.pop(tile, None)
        if start is not None:
            self.scores = self.scores.after(start, payoff)


def first_scores(spec: TrainingSpec) -> RegretScores | None:
    """The scores of a training's pool before its first step, after games of the other drivers; None for a training
    without replays. Raises as `Arena.step`, and SimulationError if SUMO can't load the scene."""
    if spec.best_known is None:
        return None
    drivers: list[Driver] = [*(reference_driver(each, spec.scene.world) for each in PERSONS), spec.best_known]
    with closing(PairedRollouts(spec.scene, pool_of(spec), games=POOL, at_once=spec.settings.games)) as games:
        payoffs, failed = zip(*map(games.play, drivers), strict=True)
    return scores_of(np.array(payoffs), np.array(failed))


def pool_of(spec: TrainingSpec) -> SeededStarts:
    """The starts of a training's pool, in all of which the people of the training take part."""
    place = spec.places[0]
    assert place.player == EGO, "only an ego has reference drivers"
    return seeded_starts(spec.scene, spec.personas[0], place.drivers[1:], 0.0, *spec.parts, "pool")
