"""Conformance of a driver to the driver protocol: seeded games, played twice, then replayed all at once.

| property | check |
| --- | --- |
| shapes, bounds, finiteness | every decision: [N, 2] finite numbers in -1 to 1; the arguments are not modified |
| determinism after `reset` | the same games again: the same actions, bit for bit |
| independence of games | the observations of all games replayed at once, one game reset in between: the same actions |
| time | of the longest decision, compared with the step of the scene; it is reported, and never a violation |

SUMO's own driver makes no decisions. For it the check is that the games can be played, and that playing them again
gives the same motion, bit for bit.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from harness.config.campaign import LEARNED, SUMO
from harness.drivers.car import car_of
from harness.drivers.external import find_driver
from harness.drivers.policy_origin import other_games
from harness.drivers.protocol import Driver, Planner, planner_of
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.errors import SimulationError, UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView
from harness.game.initial_state import draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene

_CHECKOUT = Path(__file__).resolve().parents[2]
TOLERANCE = 1e-5
"""Largest difference between the actions of one game alone and among others: the order of summation differs."""


class Decision(NamedTuple):
    """One decision of a driver in a game: observation [SIZE], noise [2], action [2], and the view of a planner."""

    observation: FloatArray
    noise: FloatArray
    action: FloatArray
    view: CartesianView | None = None


class _PlayedGame(NamedTuple):
    """The ego's decisions in one game, and its motion: x, y, heading and speed after each step, [T, 4]."""

    decisions: list[Decision]
    motion: FloatArray


@dataclass(kw_only=True)
class Findings:
    """The result of a check."""

    violations: list[str] = field(default_factory=list)
    """In words; empty: the driver conforms to the protocol."""
    passed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """About the driver, such as inputs that receive nothing."""
    outcomes: list[str] = field(default_factory=list)
    """Of the games."""
    seconds: list[float] = field(default_factory=list)
    """Of each decision."""
    game_seconds: list[float] = field(default_factory=list)
    """Of each game when it was played again: all is loaded."""
    seconds_at_once: float | None = None
    """Of a decision when the driver decided in all games at once: the median; None: not measured."""
    tunable: bool = False
    title: str = ""
    """The driver and the scene."""
    step_s: float = 0.1

    def lines(self) -> list[str]:
        """The report, line by line."""
        lines = [
            self.title,
            *(f"  pass   {each}" for each in self.passed),
            *(f"  fail   {each}" for each in self.violations),
            *(f"  note   {each}" for each in self.notes),
        ]
        if self.seconds:
            mean_s, longest_s = sum(self.seconds) / len(self.seconds), max(self.seconds)
            pace = "faster" if longest_s < self.step_s else "slower"
            lines.append(
                f"  time   {1000 * longest_s:.2f} ms per decision at most: {pace} than the scene's step of "
                f"{self.step_s:g} s; {1000 * mean_s:.2f} ms on average, {1 / mean_s:,.0f} decisions a second"
            )
        return [*lines, f"  games  {', '.join(self.outcomes)}"] if self.outcomes else lines


class _Violation(Exception):
    """A decision that violates the protocol."""


class _CheckedDriver:
    """A driver with a check of every decision. Decisions are recorded."""

    def __init__(self, driver: Driver, seconds: list[float]) -> None:
        self._driver, self._seconds = driver, seconds
        self.takes_over = driver.takes_over
        self.decisions: list[Decision] = []
        self._views: list[CartesianView | None] = []

    def reset(self, games: IntArray) -> None:
        self._driver.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        observation_argument, noise_argument = observation.copy(), noise.copy()
        began = time.perf_counter()
        result = self._driver.decide(games, observation_argument, noise_argument)
        self._seconds.append(time.perf_counter() - began)
        if not (np.array_equal(observation_argument, observation) and np.array_equal(noise_argument, noise)):
            raise _Violation("it modified the observation or the noise it was given: work on a copy")
        actions = _checked(result, len(games))
        self.decisions += map(Decision, observation.copy(), noise.copy(), actions, self._views or [None] * len(games))
        return actions


class _CheckedPlanner(_CheckedDriver):
    """A planner with a check of every decision. Its views are recorded."""

    def __init__(self, driver: Driver, planner: Planner, seconds: list[float]) -> None:
        super().__init__(driver, seconds)
        self._planner, self.history_s = planner, planner.history_s

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        self._views = list(views)
        self._planner.see(games, views)


def _with_checks(driver: Driver, seconds: list[float]) -> _CheckedDriver:
    planner = planner_of(driver)
    return _CheckedDriver(driver, seconds) if planner is None else _CheckedPlanner(driver, planner, seconds)


def _checked(result: object, games: int) -> FloatArray:
    """The result of `decide` as actions [N, 2]. Raises _Violation if it is not that."""
    if not isinstance(result, np.ndarray):
        raise _Violation(f"it decided {type(result).__name__}, not a NumPy array")
    if result.shape != (games, 2):
        raise _Violation(f"it decided an array {list(result.shape)}, not [{games}, 2]: pedals and wheel of each game")
    if result.dtype.kind not in "fiu":
        raise _Violation(f"it decided an array of {result.dtype}, not of numbers")
    if not np.isfinite(result).all():
        raise _Violation(f"it decided {result[~np.isfinite(result).all(axis=1)][0].tolist()}: not finite")
    if np.abs(result).max(initial=0.0) > 1.0:
        largest = result[np.abs(result).max(axis=1).argmax()].tolist()
        raise _Violation(f"it decided {largest}: pedals and wheel are in -1 to 1")
    return result.astype(np.float64)


def check_named(written: str, scene: Path, games: int, *, allow_code: bool) -> Findings:
    """Check a driver by its name in a campaign, on the scene of a folder: a driver document, a policy's folder, an
    installed driver, or "sumo".

    Raises UsageError if it can't be found, may not be run, or is "learned", which has no policy yet; DriverError if it
    can't be made.
    """
    if written == LEARNED:
        message = f"{LEARNED!r} is trained by a campaign: before the training there is no driver to check"
        remedy = "name the folder of a trained policy, such as RUN/policies/naive-seed11"
        raise UsageError.of("DRIVER", "", message, remedy)
    external = None if written == SUMO else find_driver(written, Path("DRIVER"), key="", allow_code=allow_code)
    folder = scene if scene.exists() else _CHECKOUT / scene
    opened = open_scene(folder, external.vehicle_type if external else None)
    if external is None:
        driver: Driver = SumoDriver()
        title = f"SUMO's own models of vehicle type {opened.vehicle(EGO).vehicle_type} ({SUMO})"
    else:
        driver, title = external.make(car_of(opened.world, EGO), sampled=False), external.in_words
    findings = check_conformance(driver, opened, games)
    findings.notes += external.notes if external is not None else ()
    if external is not None and external.document is None:
        findings.notes += filter(None, [other_games(external.place, opened.document, opened.world, player=EGO)])
    findings.tunable = external is not None and bool(external.searched)
    findings.title, findings.step_s = f"{title}, on {opened.document.name}", opened.world.step_s
    return findings


def check_conformance(driver: Driver, scene: OpenScene, games: int) -> Findings:
    """Play `games` games with a driver as the ego and SUMO's driver as every non-ego, and check the driver.

    Raises SimulationError if SUMO fails; an exception of the driver is a violation.
    """
    findings = Findings()
    try:
        first = _play(driver, scene, games, findings=findings, activity="playing")
        again = _play(driver, scene, games, findings=findings, activity="playing the same games again")
        _check_determinism(driver, first, again, findings)
        if driver.takes_over and not findings.violations:
            _check_independence(driver, [game.decisions for game in first], findings)
    except _Violation as error:
        findings.violations.append(str(error))
    return findings


def difference_of(driver: Driver, scene: OpenScene) -> str:
    """Play one game twice: what a driver decided otherwise the second time, in words; empty if nothing, and if the game
    can't be played. Raises SimulationError if SUMO fails."""
    findings = Findings()
    try:
        first, again = (_play(driver, scene, 1, findings=findings, activity="playing") for _ in range(2))
        _check_determinism(driver, first, again, findings)
    except _Violation:
        return ""
    return "".join(findings.violations)


def _play(driver: Driver, scene: OpenScene, games: int, *, findings: Findings, activity: str) -> list[_PlayedGame]:
    people = len(scene.world.roles) - 1
    checked, played, outcomes = _with_checks(driver, findings.seconds), list[_PlayedGame](), list[str]()
    findings.game_seconds = []
    arena = Arena(scene, 1, [Seat(checked), *[Seat(SumoDriver())] * people])
    try:
        for game in range(games):
            parts = ("check-driver", game)
            start = draw_initial_state(scene.usual_starts, *parts)
            checked.decisions, began = [], time.perf_counter()
            motion: list[FloatArray] = []
            try:
                arena.reload(start.seed)
                arena.reset({0: start}, {0: scene.departures(*parts)})
                while arena.state.running[0, EGO]:
                    state = arena.step().quantities.state
                    pose = (state.x_m, state.y_m, state.heading_rad, state.speed_mps)
                    motion.append(np.array([values[0, EGO] for values in pose]))
            except (SimulationError, _Violation, MemoryError):
                raise
            except Exception as error:  # a driver may raise any exception
                where = f"{activity}, game {game}, decision {len(checked.decisions)}"
                raise _Violation(f"{where}: it raised {type(error).__name__}: {error}") from error
            findings.game_seconds.append(time.perf_counter() - began)
            played.append(_PlayedGame(checked.decisions, np.array(motion).reshape(-1, 4)))
            outcomes.append(Outcome(int(arena.state.outcome[0, EGO])).word)
    finally:
        arena.close()
    findings.outcomes = findings.outcomes or outcomes
    return played


def _check_determinism(
    driver: Driver, first: Sequence[_PlayedGame], again: Sequence[_PlayedGame], findings: Findings
) -> None:
    what = "actions" if driver.takes_over else "motion"
    if driver.takes_over:
        count = sum(len(game.decisions) for game in first)
        findings.passed.append(f"{count} decisions: [N, 2] finite numbers from -1 to 1")
    else:
        count = sum(len(game.motion) for game in first)
        findings.passed.append(f"{count} steps: SUMO's own models move the ego, so there are no actions to check")
    for number, (one, other) in enumerate(zip(first, again, strict=True)):
        for step, (before, now) in enumerate(zip(one.decisions, other.decisions, strict=False)):
            if not np.array_equal(before.action, now.action):
                where, actions = f"decision {step} of game {number}", (before.action.tolist(), now.action.tolist())
                findings.violations.append(
                    f"it is not deterministic: in {where} it decided {actions[0]}, and {actions[1]} when the same game "
                    "was played again; reset must discard the state of the game, and random numbers must come from "
                    "the noise argument"
                )
                return
        if not driver.takes_over and not np.array_equal(one.motion, other.motion):
            findings.violations.append(f"it is not deterministic: game {number}, played again, had another motion")
            return
    findings.passed.append(f"the same games again: the same {what}, bit for bit")


def _check_independence(driver: Driver, played: Sequence[Sequence[Decision]], findings: Findings) -> None:
    """Replay the observations of all games at once. The shortest game is reset at its end and replayed, as in a
    training."""
    shortest = min(range(len(played)), key=lambda game: len(played[game]))
    replayed = [list(each) for each in played]
    replayed[shortest] = [*played[shortest], *played[shortest]]
    reset_at = len(played[shortest])
    seconds, rows_of_call = list[float](), list[int]()
    checked = _with_checks(driver, seconds)
    checked.reset(np.arange(len(replayed)))
    for step in range(max(map(len, replayed))):
        if step == reset_at:
            checked.reset(np.array([shortest]))
        games = np.array([game for game, each in enumerate(replayed) if step < len(each)])
        rows = [replayed[game][step] for game in games]
        rows_of_call.append(len(rows))
        if isinstance(checked, _CheckedPlanner):
            checked.see(games, [row.view for row in rows if row.view is not None])
        actions = checked.decide(games, np.array([r.observation for r in rows]), np.array([r.noise for r in rows]))
        difference = np.abs(actions - np.array([row.action for row in rows])).max(axis=1)
        if difference.max() > TOLERANCE:
            worst = int(difference.argmax())
            findings.violations.append(
                f"its games are not independent: in decision {step} of game {int(games[worst])} it decided "
                f"{actions[worst].tolist()} with {len(games)} games at once, and {rows[worst].action.tolist()} alone; "
                "the state must be kept per game"
            )
            return
    findings.seconds_at_once = float(np.median(np.array(seconds) / rows_of_call))
    findings.passed.append(f"{len(replayed)} games at once, one of them reset in between: the same actions as alone")
