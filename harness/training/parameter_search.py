"""Reconfiguring an ego that can't be trained: its tunable parameters are searched on its own payoff.

Every trial plays the same games. The first has the parameters that the ego was given, so that what is found is never
worse in them. Trials are kept on disk, and each is proposed from those before it and from seeds hashed from its number
alone: a search that was interrupted and one that was not are the same search.
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

from harness.config.campaign import Reconfiguration
from harness.config.persona import Persona
from harness.config.tunable import Tunable
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver
from harness.drivers.mixture import Mixture
from harness.drivers.protocol import Driver
from harness.errors import SimulationError, StageFailed, is_of_memory
from harness.files import write_atomically
from harness.game.seeding import seed_of
from harness.game.state import EGO
from harness.traffic.scene import OpenScene
from harness.training.paired_rollouts import PairedRollouts


@dataclass(frozen=True)
class Search:
    """What one search is made of: whose parameters, on what payoff, against whom."""

    scene: OpenScene
    driver: ExternalDriver
    personas: tuple[Persona, Persona]  # of the ego's seat and of the non-ego's
    opponent: Driver | Mixture
    settings: Reconfiguration
    parts: tuple[str | int, ...]
    """Names the search's random numbers."""


@dataclass(frozen=True)
class Trial:
    """One driver that was tried: the values of its parameters, and what came of its games."""

    values: Mapping[str, float]
    mean_payoff: float | None
    """None: its games could not be played."""
    failure_rate: float | None
    error: str = ""
    """Why they could not."""


def run_search(
    search: Search,
    kept: Path,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_start: Callable[[int], None] = lambda trial: None,
) -> list[Trial]:
    """Every trial of a search, those in the file `kept` taken as they are; each new one is added to it.

    `on_progress` gets the number of trials done and their total, `on_start` the number of each trial before it starts.
    A driver that can't be made or can't play with some values is a trial without a payoff. Raises StageFailed where the
    ego can't play as it was given, SimulationError where SUMO fails.
    """
    trials, wanted = read_trials(kept)[: search.settings.trials], search.settings.trials
    on_progress(len(trials), wanted)
    if len(trials) == wanted:
        return trials
    settings = search.settings
    how = settings.games, settings.games_at_once, settings.alone_share, (*search.parts, "games")
    with closing(PairedRollouts(search.scene, search.personas, search.opponent, *how)) as games:
        while len(trials) < wanted:
            on_start(len(trials))
            values = propose(search.driver.searched, trials, *search.parts) if trials else search.driver.numbers
            trials.append(_try(search, games, values))
            if trials[0].error:
                raise StageFailed(f"the ego could not play as it was given: {trials[0].error}")
            write_trials(trials, kept)
            on_progress(len(trials), wanted)
    return trials


def best(trials: Sequence[Trial]) -> int:
    """The trial with the greatest mean payoff; the earliest of those that are equal."""
    payoffs = [float("-inf") if each.mean_payoff is None else each.mean_payoff for each in trials]
    return payoffs.index(max(payoffs))


def propose(tunable: Sequence[Tunable], trials: Sequence[Trial], *parts: str | int) -> dict[str, float]:
    """What to try next, by a tree-structured Parzen estimator of the trials so far; at random for the first ten."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    ranges: dict[str, Any] = {key: optuna.distributions.FloatDistribution(low, high) for key, low, high in tunable}
    seed = seed_of(*parts, "trial", len(trials)) % 2**32
    study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed))
    for trial in trials:
        failed = optuna.trial.TrialState.FAIL if trial.mean_payoff is None else optuna.trial.TrialState.COMPLETE
        study.add_trial(
            optuna.trial.create_trial(
                state=failed, params=dict(trial.values), distributions=ranges, value=trial.mean_payoff
            )
        )
    return dict(study.ask(ranges).params)


def _try(search: Search, games: PairedRollouts, values: Mapping[str, float]) -> Trial:
    sampled = search.personas[EGO].decisions == "sampled"
    driver: Driver | None = None
    try:
        given = search.driver if values == search.driver.numbers else search.driver.tuned(values)
        driver = given.make(car_of(search.scene.world, EGO), sampled)
        played = games.play(driver)
        return Trial(values, float(played.payoff.mean()), float(played.failed.mean()))
    except (SimulationError, OSError):
        raise
    except Exception as error:  # a driver may raise what it likes: others are tried
        if is_of_memory(error):
            raise
        return Trial(values, None, None, f"{type(error).__name__}: {error}")
    finally:
        if driver is not None and (close := getattr(driver, "close", None)):
            close()


def write_trials(trials: Sequence[Trial], file: Path) -> None:
    """Keep trials, so that they are read back bit for bit, or not at all."""
    rows = [asdict(trial) for trial in trials]
    write_atomically(file, (json.dumps({"sha256": _digest(rows), "trials": rows}, indent=1) + "\n").encode())


def read_trials(file: Path) -> list[Trial]:
    """The trials that were kept; none where the file is not there, or not as it was written."""
    try:
        said = json.loads(file.read_bytes())
        return [Trial(**row) for row in said["trials"]] if said["sha256"] == _digest(said["trials"]) else []
    except (OSError, ValueError, LookupError, TypeError):
        return []


def _digest(rows: Any) -> str:
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()


def version_of_search() -> dict[str, str]:
    """The program that proposes trials: with another, they are not promised to be the same."""
    return {"optuna": importlib.metadata.version("optuna")}
