"""Whether a driver keeps to the protocol: seeded games, played twice and again together, and what was wrong in words.

| asked | how |
| --- | --- |
| shapes, bounds, finiteness | every decision: [N, 2] numbers in -1 to 1, and the observation left as it was |
| determinism after `reset` | the same games again: the same actions, bit for bit |
| independence | what was seen in the games, shown again with all of them at once and one begun anew: the same actions |
| time | of a decision, against the scene's step; slow is told, not wrong |
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.drivers.car import car_of
from harness.drivers.external import find_driver
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.errors import SimulationError, UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.attention import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.seeding import generator_of
from harness.game.state import EGO, Outcome
from harness.traffic.scene import OpenScene, open_scene

_CHECKOUT = Path(__file__).resolve().parents[2]
SAME = 1e-5
"""Actions of one game alone and among others may differ by so much: linear algebra adds up in another order."""


@dataclass(frozen=True)
class Decision:
    """What a driver saw in a game, and did."""

    observation: FloatArray
    noise: FloatArray
    action: FloatArray


@dataclass
class Findings:
    """What came of the check."""

    wrong: list[str] = field(default_factory=list)
    """In words. Nothing: the driver keeps to the protocol."""
    right: list[str] = field(default_factory=list)
    outcomes: list[str] = field(default_factory=list)
    """Of the games."""
    seconds: list[float] = field(default_factory=list)
    """Of each decision."""
    title: str = ""
    """Which driver, and where."""
    step_s: float = 0.1

    def lines(self) -> list[str]:
        """All of it, for a reader."""
        told = [self.title, *(f"  right  {each}" for each in self.right), *(f"  wrong  {each}" for each in self.wrong)]
        if self.seconds:
            mean, most = 1000 * sum(self.seconds) / len(self.seconds), 1000 * max(self.seconds)
            pace = "faster" if mean < 1000 * self.step_s else "slower"
            told.append(
                f"  time   {mean:.2f} ms per decision, {most:.2f} ms at most: {pace} than the road's {self.step_s:g} s"
            )
        return [*told, f"  games  {', '.join(self.outcomes)}"] if self.outcomes else told


class _NotConformant(Exception):
    """A decision that is none."""


class _Watched:
    """A driver whose every decision is looked at, and kept."""

    takes_over = True

    def __init__(self, driver: Driver, seconds: list[float]) -> None:
        self._driver, self._seconds = driver, seconds
        self.decisions: list[Decision] = []

    def reset(self, games: IntArray) -> None:
        self._driver.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        shown, chance = observation.copy(), noise.copy()
        began = time.perf_counter()
        given = self._driver.decide(games, shown, chance)
        self._seconds.append(time.perf_counter() - began)
        if not (np.array_equal(shown, observation) and np.array_equal(chance, noise)):
            raise _NotConformant("it wrote into the observation or the noise it was given: copy them first")
        actions = _checked(given, len(games))
        self.decisions += [Decision(*row) for row in zip(observation.copy(), noise.copy(), actions, strict=True)]
        return actions


def _checked(given: object, games: int) -> FloatArray:
    """The actions. Raises _NotConformant saying what is wrong with them."""
    if not isinstance(given, np.ndarray):
        raise _NotConformant(f"it decided {type(given).__name__}, not a NumPy array")
    if given.shape != (games, 2):
        raise _NotConformant(
            f"it decided an array {list(given.shape)}, not [{games}, 2]: pedals and wheel of each game"
        )
    if given.dtype.kind not in "fiu":
        raise _NotConformant(f"it decided an array of {given.dtype}, not of numbers")
    if not np.isfinite(given).all():
        raise _NotConformant(f"it decided {given[~np.isfinite(given).all(axis=1)][0].tolist()}: not finite")
    if np.abs(given).max(initial=0.0) > 1.0:
        far = given[np.abs(given).max(axis=1).argmax()].tolist()
        raise _NotConformant(f"it decided {far}: pedals and wheel go from -1 to 1")
    return given.astype(np.float64)


def check_named(written: str, scene: Path, games: int, allow_code: bool) -> Findings:
    """Check a driver document, a policy's folder or an installed driver on the scene of a folder.

    Raises UsageError where it can't be found, may not be run, or decides nothing; DriverError where it can't be made.
    """
    given = find_driver(written, Path("DRIVER"), "", allow_code)
    opened = open_scene(scene if scene.exists() else _CHECKOUT / scene, given.vehicle_type)
    driver = given.make(car_of(opened.world, EGO), sampled=False)
    if not driver.takes_over:
        raise UsageError.of(written, "", "is driven by SUMO: it makes no decisions to check", "harness check FILE")
    found = check_conformance(driver, opened, games)
    found.title, found.step_s = f"{given.in_words}, on {opened.document.name}", opened.world.step_s
    return found


def check_conformance(driver: Driver, scene: OpenScene, games: int) -> Findings:
    """Play a driver as the ego beside SUMO's driver, and say what is wrong with it.

    Raises SimulationError where SUMO fails; whatever the driver raises is in the findings.
    """
    found = Findings()
    try:
        first = _play(driver, scene, games, found, "playing")
        again = _play(driver, scene, games, found, "playing the same games again")
        _compare(first, again, found)
        if not found.wrong:
            _together(driver, first, found)
    except _NotConformant as error:
        found.wrong.append(str(error))
    return found


def _play(driver: Driver, scene: OpenScene, games: int, found: Findings, doing: str) -> list[list[Decision]]:
    """The decisions of each game."""
    start_distribution = scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 1.0])
    watched, played, outcomes = _Watched(driver, found.seconds), list[list[Decision]](), list[str]()
    arena = Arena(scene, 1, [Seat(watched), Seat(SumoDriver())])
    try:
        for game in range(games):
            parts = ("check-driver", game)
            start = draw_initial_state(start_distribution, *parts)
            watched.decisions = []
            try:
                arena.reload(start.seed)
                arena.reset({0: start}, {0: scene.departures(generator_of(*parts, "others"))})
                while arena.state.running[0, EGO]:
                    arena.step()
            except (SimulationError, _NotConformant, MemoryError):
                raise
            except Exception as error:  # a driver may raise what it likes
                where = f"{doing}, game {game}, decision {len(watched.decisions)}"
                raise _NotConformant(f"{where}: it raised {type(error).__name__}: {error}") from error
            played.append(watched.decisions)
            outcomes.append(Outcome(int(arena.state.outcome[0, EGO])).word)
    finally:
        arena.close()
    found.outcomes = found.outcomes or outcomes
    return played


def _compare(first: Sequence[Sequence[Decision]], again: Sequence[Sequence[Decision]], found: Findings) -> None:
    decisions = sum(map(len, first))
    found.right.append(f"{decisions} decisions: [N, 2] finite numbers from -1 to 1")
    for game, (one, other) in enumerate(zip(first, again, strict=True)):
        for step, (a, b) in enumerate(zip(one, other, strict=False)):
            if not np.array_equal(a.action, b.action):
                was, now = a.action.tolist(), b.action.tolist()
                found.wrong.append(
                    f"it is not deterministic: in decision {step} of game {game} it decided {was}, and {now} when the "
                    "same game was played again; reset has to forget the game before, and chance comes as noise"
                )
                return
    found.right.append("the same games again: the same actions, bit for bit")


def _together(driver: Driver, played: Sequence[Sequence[Decision]], found: Findings) -> None:
    """Show the games again, all at once; the shortest is begun anew when it is over, as a training does."""
    shortest = min(range(len(played)), key=lambda game: len(played[game]))
    shown = [list(each) for each in played]
    shown[shortest] = [*played[shortest], *played[shortest]]
    begun_anew = len(played[shortest])
    watched = _Watched(driver, [])
    watched.reset(np.arange(len(shown)))
    for step in range(max(map(len, shown))):
        if step == begun_anew:
            watched.reset(np.array([shortest]))
        games = np.array([game for game, each in enumerate(shown) if step < len(each)])
        rows = [shown[game][step] for game in games]
        actions = watched.decide(games, np.array([r.observation for r in rows]), np.array([r.noise for r in rows]))
        off = np.abs(actions - np.array([row.action for row in rows])).max(axis=1)
        if off.max() > SAME:
            game = int(games[off.argmax()])
            found.wrong.append(
                f"its games are not independent: in decision {step} of game {game} it decided "
                f"{actions[off.argmax()].tolist()} with {len(games)} games at once, and "
                f"{rows[int(off.argmax())].action.tolist()} alone; what is remembered has to be kept for each game"
            )
            return
    found.right.append(f"{len(shown)} games at once, one of them begun anew: the same actions as alone")
