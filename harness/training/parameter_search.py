"""Reconfiguration of an ego that can't be trained: a search of its tunable parameters for its own payoff.

Every trial plays the same games. The first trial has the ego's own parameters, so the best trial is never worse than
the ego in these games. Trials are stored on disk. Each is proposed from the trials before it and from a seed that
depends on its number only: an interrupted search gives the same trials as an uninterrupted one.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import TrialState, create_trial

from harness.config.persona import Persona
from harness.config.training import Reconfiguration
from harness.config.tunable import Tunable
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver
from harness.drivers.mixture import Mixture
from harness.drivers.protocol import Driver
from harness.errors import SimulationError, StageFailed, is_of_memory
from harness.files import write_atomically
from harness.game.roles import EGO
from harness.game.seeding import seed_of
from harness.road.scene.open_scene import OpenScene
from harness.training.paired_rollouts import PairedRollouts, seeded_starts


@dataclass(frozen=True, kw_only=True)
class SearchSpec:
    """The inputs of a search: the ego's driver with its parameters, its persona, and the people that it meets."""

    scene: OpenScene
    driver: ExternalDriver
    persona: Persona
    people: tuple[Mixture | None, ...]
    settings: Reconfiguration
    parts: tuple[str | int, ...]
    """They name the random numbers of the search."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One trial: the values of the parameters, and the results of the games."""

    values: Mapping[str, float]
    mean_payoff: float | None
    """None: the games could not be played."""
    failure_rate: float | None
    error: str = ""
    """Why they could not be played; empty: they were."""


def run_search(
    search: SearchSpec,
    file: Path,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_start: Callable[[int], None] = lambda trial: None,
) -> list[Trial]:
    """All trials of a search. Trials in `file` are reused; each new trial is added to it.

    `on_progress` gets the number of finished trials and their total, `on_start` the number of each trial before it
    starts. If a driver can't be made or can't play with some values, the trial has no payoff. Raises StageFailed if the
    ego can't play with its own parameters, SimulationError if SUMO fails.
    """
    settings = search.settings
    trials, total = read_trials(file)[: settings.trials], settings.trials
    on_progress(len(trials), total)
    if len(trials) == total:
        return trials
    games = PairedRollouts(
        search.scene,
        seeded_starts(search.scene, search.persona, search.people, settings.alone_share, *search.parts, "games"),
        games=settings.games,
        at_once=settings.games_at_once,
    )
    with closing(games):
        while len(trials) < total:
            on_start(len(trials))
            values = propose(search.driver.searched, trials, *search.parts) if trials else search.driver.numbers
            trials.append(_run_trial(search, games, values))
            if trials[0].error:
                raise StageFailed(f"the ego could not play with its own parameters: {trials[0].error}")
            write_trials(trials, file)
            on_progress(len(trials), total)
    return trials


def best(trials: Sequence[Trial]) -> int:
    """The trial with the greatest mean payoff; the earliest of those that are equal."""
    payoffs = [float("-inf") if each.mean_payoff is None else each.mean_payoff for each in trials]
    return payoffs.index(max(payoffs))


def propose(tunable: Sequence[Tunable], trials: Sequence[Trial], *parts: str | int) -> dict[str, float]:
    """The values of the next trial: random for the first ten trials, then from a tree-structured Parzen estimator."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    ranges: dict[str, Any] = {key: optuna.distributions.FloatDistribution(low, high) for key, low, high in tunable}
    seed = seed_of(*parts, "trial", len(trials)) % 2**32
    study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed))
    for trial in trials:
        state, values = TrialState.FAIL if trial.mean_payoff is None else TrialState.COMPLETE, dict(trial.values)
        study.add_trial(create_trial(state=state, params=values, distributions=ranges, value=trial.mean_payoff))
    return dict(study.ask(ranges).params)


def _run_trial(search: SearchSpec, games: PairedRollouts, values: Mapping[str, float]) -> Trial:
    sampled = search.persona.decisions == "sampled"
    driver: Driver | None = None
    try:
        external = search.driver if values == search.driver.numbers else search.driver.tuned(values)
        driver = external.make(car_of(search.scene.world, EGO), sampled)
        payoff, failed = games.play(driver)
        return Trial(values=values, mean_payoff=float(payoff.mean()), failure_rate=float(failed.mean()))
    except (SimulationError, OSError):
        raise
    except Exception as error:  # a driver may raise any exception: the search continues
        if is_of_memory(error):
            raise
        return Trial(values=values, mean_payoff=None, failure_rate=None, error=f"{type(error).__name__}: {error}")
    finally:
        if driver is not None and (close := getattr(driver, "close", None)):
            close()


def write_trials(trials: Sequence[Trial], file: Path) -> None:
    """Write trials with a checksum, which `read_trials` verifies."""
    rows = [asdict(trial) for trial in trials]
    write_atomically(file, (json.dumps({"sha256": _digest(rows), "trials": rows}, indent=1) + "\n").encode())


def read_trials(file: Path) -> list[Trial]:
    """The trials in a file; none if the file is missing or damaged."""
    try:
        content = json.loads(file.read_bytes())
        return [Trial(**row) for row in content["trials"]] if content["sha256"] == _digest(content["trials"]) else []
    except (OSError, ValueError, LookupError, TypeError):
        return []


def _digest(rows: Any) -> str:
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()


def version_of_search() -> dict[str, str]:
    """The version of the library that proposes trials: another version may propose other values."""
    return {"optuna": importlib.metadata.version("optuna")}
