"""Campaigns from Python: `harness.run` carries one out, `harness.load` reads the run folder of one.

results = harness.run("demo")
results.summary[["arm", "failure_rate"]]
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.policy_file import Policy, read_policy
from harness.errors import UsageError
from harness.files import content_of
from harness.shipped_documents import document_at

if TYPE_CHECKING:
    import pandas as pd

_RESULT = "result.json"
_MOST_BYTES = 50_000_000


@dataclass(frozen=True)
class Results:
    """The results in a run folder. Tables are read when they are asked for.

    >>> import harness
    >>> results = harness.load("reports/merge")
    >>> results.episodes.columns[:4].tolist()
    ['arm', 'persona', 'seed', 'episode']
    >>> float(results.summary.set_index("arm")["failure_rate"]["naive_alone"])
    0.0
    >>> results.verdicts[0]["persona"], results.verdicts[0]["question"]
    ('speedy', 'RQ1')
    """

    path: Path
    """The run folder."""

    def table(self, name: str) -> pd.DataFrame:
        """A table of the run, by the name of its CSV file: `table("manoeuvres")`.

        `harness columns` describes the columns; their names end with their units. Raises UsageError, which lists the
        tables of the run, if it has no such table, and for one that was changed.
        """
        from harness.evaluation.tables import read_csv

        tables = sorted(each.stem for each in self.path.glob("*.csv"))
        if name not in tables:
            raise UsageError.of(self.path, f"table {name!r}", "is none of this run", f"tables: {', '.join(tables)}")
        return read_csv(RunFolder(self.path).result(f"{name}.csv"))

    def trace(self, arm: str, seed: int, episode: int) -> pd.DataFrame:
        """The recording of a game: a row for each road user in each step, with its pose, speed and outcome.

        `harness columns` describes the columns, as `docs/columns.md` does. Raises UsageError if the run has no such
        game, if the game could not be played, and if the folder does not contain the traces.
        """
        from harness.campaign.results.replay_game import find_game
        from harness.evaluation.trace_file import TraceReader

        _, traces = find_game(RunFolder(self.path), arm, episode, seed)
        return TraceReader().read(traces, episode)

    @property
    def episodes(self) -> pd.DataFrame:
        """A row per game."""
        return self.table("episodes")

    @property
    def summary(self) -> pd.DataFrame:
        """A row per arm and training seed."""
        return self.table("summary")

    @property
    def comparisons(self) -> pd.DataFrame:
        """A row per question of the campaign, with its test."""
        return self.table("comparisons")

    @cached_property
    def outcome(self) -> Mapping[str, Any]:
        """The content of `result.json`. Raises UsageError if it can't be read."""
        try:
            return dict(json.loads(content_of(RunFolder(self.path).result(_RESULT), _MOST_BYTES)))
        except (OSError, ValueError, TypeError) as error:
            remedy = f"write it anew: harness report {self.path}"
            raise UsageError.of(self.path / _RESULT, "", f"can't be read: {error}", remedy) from None

    @property
    def verdicts(self) -> list[dict[str, Any]]:
        """Persona, question, label and sentence of each verdict, what it is about, and the number of planned tests."""
        return list(self.outcome["verdicts"])

    @property
    def accepted(self) -> bool | None:
        """Whether every bound of the campaign's `[acceptance]` is kept; None without bounds."""
        accepted: bool | None = self.outcome["accepted"]
        return accepted

    @property
    def complete(self) -> bool:
        """Whether every stage was carried out and every game was played."""
        return not self.outcome["failed_stages"] and not self.outcome["error_games"]

    @property
    def policies(self) -> Mapping[str, Policy]:
        """The policies that the run trained, by stage. Raises UsageError if one is damaged."""
        cards = sorted(self.path.glob("policies/*/policy.json"))
        return {card.parent.name: read_policy(card.parent) for card in cards}

    def policy(self, stage: str) -> Policy:
        """The policy of a training, such as "naive-seed11". Raises UsageError if the run has none."""
        return read_policy(self.path / "policies" / stage)


def run(
    campaign: str | Path,
    *,
    out: str | Path | None = None,
    quick: bool = False,
    jobs: int | None = None,
    allow_code: bool = False,
    keep_going: bool = False,
    progress: bool = False,
) -> Results:
    """Carry out a campaign, or what is left of it, as `harness campaign` does.

    `campaign` is a TOML file or the name of a shipped campaign, `out` the run folder (default: `reports/NAME` in the
    working folder), `jobs` the number of stages carried out at once (default: one per core), `allow_code` and
    `keep_going` are those of the command, and `progress` prints what it prints. Raises UsageError for mistakes in
    documents. A stage that fails is in the results, not raised.

    >>> import harness
    >>> results = harness.run("two_games.toml", jobs=1)
    >>> results.complete, len(results.episodes)
    (True, 12)
    >>> list(results.policies)
    []
    """
    from rich.console import Console

    from harness.campaign.execution.run_campaign import run_campaign
    from harness.campaign.execution.worker_pool import WorkerPool
    from harness.campaign.preflight import open_campaign

    opened = open_campaign(document_at(Path(campaign), "campaigns"), quick, allow_code)
    folder = RunFolder(Path(out) if out is not None else Path("reports") / opened.run_name)
    console = Console(file=None if progress else io.StringIO())
    run_campaign(opened, folder, partial(WorkerPool, jobs=jobs), console, keep_going=keep_going)
    return load(folder.path)


def load(run: str | Path) -> Results:
    """The results in a run folder. Raises UsageError if there is no run in it.

    >>> import harness
    >>> harness.load("reports/merge").accepted
    True
    """
    folder = RunFolder(Path(run))
    folder.manifest()
    return Results(folder.path)
