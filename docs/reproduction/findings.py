"""The findings of a run of docs/reproduction/five-seeds.toml, seed by seed, against the expected ones.

    python docs/reproduction/findings.py reports/five-seeds

prints the table of docs/reproduction.md from the run folder's CSV files. It plays only the games of a
law-abiding driver in the speedy driver's place: SUMO drives the non-ego against each seed's naive ego, on the speedy
driver's payoff.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from harness.assessment.rollout import SeatedArm, assess
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver, read_policy
from harness.drivers.sumo import SumoDriver
from harness.road.scene.open_scene import open_scene

ROOT = Path(__file__).parents[2]
PERSONAS = ("paper_speedy", "paper_distracted")
ALPHA = 0.01


@dataclass(frozen=True, kw_only=True)
class Tables:
    """The tables of a run, restricted to one training seed."""

    episodes: pd.DataFrame
    comparisons: pd.DataFrame
    lawful_payoff: float
    limit_mps: float

    def mean(self, arm: str, column: str) -> float:
        """Mean over the arm's episodes that were played."""
        rows = self.episodes[(self.episodes["arm"] == arm) & self.episodes["error"].isna()]
        return float(rows[column].astype(float).mean())

    def failures(self, arm: str) -> float:
        """Share of the arm's games in which the ego failed."""
        return self.mean(arm, "ego_failed")

    def speed(self, arm: str) -> float:
        """The ego's mean speed in the arm, m/s."""
        return self.mean(arm, "ego_mean_speed_mps")

    def goals(self, arm: str) -> float:
        """Share of the arm's games in which the non-ego reached its goal."""
        rows = self.episodes[self.episodes["arm"] == arm]
        return float((rows["non_ego_outcome"] == "goal").mean())

    def p(self, question: str, persona: str, column: str) -> float:
        """p of the question about failures. `column`: `p_value`, or `p_holm` with Holm's correction."""
        rows = self.comparisons
        rows = rows[(rows["question"] == question) & (rows["persona"] == persona) & (rows["metric"] == "failure")]
        return float(rows[column].iloc[0])


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A row: a value of a run and its expected range."""

    what: str
    bound: str
    """The expected range, in words."""
    value: Callable[[Tables], float]
    holds: Callable[[float], bool]
    form: str = "{:.0%}"
    """Format of the value."""


def findings() -> list[Finding]:
    """All rows, in the order of the page."""
    rows = [
        _failure_rate("naive_alone", "0", lambda rate: rate == 0.0),
        _failure_rate("naive_vs_sumo", "≤ 3 %", lambda rate: rate <= 0.03),
        _failure_rate("naive_vs_paper_speedy", "≥ 20 %", lambda rate: rate >= 0.20),
        Finding(
            what="naive_vs_paper_speedy: speed against naive_alone",
            bound="lower",
            value=lambda tables: tables.speed("naive_vs_paper_speedy") / tables.speed("naive_alone") - 1.0,
            holds=lambda change: change < 0.0,
            form="{:+.1%}",
        ),
        _failure_rate("retrained_vs_paper_speedy", "≤ 3 %", lambda rate: rate <= 0.03),
        Finding(
            what="retrained_vs_paper_speedy: speed against naive_alone",
            bound="within 5 %",
            value=lambda tables: tables.speed("retrained_vs_paper_speedy") / tables.speed("naive_alone") - 1.0,
            holds=lambda change: abs(change) <= 0.05,
            form="{:+.1%}",
        ),
        _failure_rate("naive_vs_paper_distracted", "≥ 12 %", lambda rate: rate >= 0.12),
        _failure_rate("retrained_vs_paper_distracted", "≤ 5 %", lambda rate: rate <= 0.05),
        *(_failure_rate(f"retrained_alone_{persona}", "0", lambda rate: rate == 0.0) for persona in PERSONAS),
        _goal_rate("paper_speedy_alone: goal", "≥ 97 %", 0.97),
        _goal_rate("paper_distracted_alone: goal", "≥ 80 %", 0.80),
        _goal_rate("naive_vs_paper_speedy: its own goal", "≥ 60 %", 0.60),
        Finding(
            what="paper_speedy_alone: speed against the limit",
            bound="+5 to +30 %",
            value=lambda tables: tables.mean("paper_speedy_alone", "non_ego_mean_speed_mps") / tables.limit_mps - 1.0,
            holds=lambda change: 0.05 <= change <= 0.30,
            form="{:+.1%}",
        ),
        Finding(
            what="naive_vs_paper_speedy: its payoff less a law-abiding driver's",
            bound="> 0",
            value=lambda tables: tables.mean("naive_vs_paper_speedy", "non_ego_payoff") - tables.lawful_payoff,
            holds=lambda difference: difference > 0.0,
            form="{:+.1f}",
        ),
    ]
    return rows + [
        _significance(question, persona, column, word)
        for question in ("RQ1", "RQ2")
        for persona in PERSONAS
        for column, word in (("p_value", "p"), ("p_holm", "Holm-corrected p"))
    ]


def _failure_rate(arm: str, bound: str, holds: Callable[[float], bool]) -> Finding:
    return Finding(what=f"{arm}: failures", bound=bound, value=lambda tables: tables.failures(arm), holds=holds)


def _goal_rate(what: str, bound: str, least: float) -> Finding:
    arm = what.partition(":")[0]
    return Finding(what=what, bound=bound, value=lambda tables: tables.goals(arm), holds=lambda rate: rate >= least)


def _significance(question: str, persona: str, column: str, word: str) -> Finding:
    return Finding(
        what=f"{question} {persona}: {word} of failure",
        bound=f"< {ALPHA}",
        value=lambda tables: tables.p(question, persona, column),
        holds=lambda p: p < ALPHA,
        form="{:.2g}",
    )


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder, such as reports/five-seeds.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write the table as CSV.")] = None,
) -> None:
    """Print the table of findings as Markdown, a column per training seed."""
    episodes, comparisons = pd.read_csv(run / "episodes.csv"), pd.read_csv(run / "comparisons.csv")
    seeds = sorted(episodes["seed"].unique())
    count = int((episodes["arm"] == "naive_alone").sum() / len(seeds))
    start_seed, tables = int(episodes["seed"].iloc[0]), {}
    for seed in seeds:
        lawful_payoff, limit_mps = _play_lawful_driver(run, int(seed), start_seed, count)
        tables[seed] = Tables(
            episodes=episodes[episodes["seed"] == seed],
            comparisons=comparisons[comparisons["seed"] == seed],
            lawful_payoff=lawful_payoff,
            limit_mps=limit_mps,
        )
    print("| finding | expected | " + " | ".join(f"seed {seed}" for seed in seeds) + " | held |")
    print("| --- | --- |" + " --- |" * (len(seeds) + 1))
    rows = []
    for finding in findings():
        values = {seed: finding.value(tables[seed]) for seed in seeds}
        held = sum(finding.holds(value) for value in values.values())
        shown = " | ".join(finding.form.format(value) for value in values.values())
        print(f"| {finding.what} | {finding.bound} | {shown} | {held} of {len(seeds)} |")
        row = {"what": finding.what, "was_to_be": finding.bound}
        rows.append({**row, **{f"seed_{seed}": value for seed, value in values.items()}, "held": held})
    if out is not None:
        pd.DataFrame(rows).to_csv(out, index=False)


def _play_lawful_driver(run: Path, seed: int, start_seed: int, episodes: int) -> tuple[float, float]:
    """The mean payoff of SUMO's driver in the speedy driver's place, on its terms, and the speed limit in m/s."""
    scene = open_scene(ROOT / "networks" / "paper_merge")
    careful, speedy = (read_document(ROOT / "personas" / f"{n}.toml", Persona) for n in ("careful", "paper_speedy"))
    naive = LearnedDriver(read_policy(run / "policies" / f"naive-seed{seed}"), careful.decisions == "sampled")
    drivers = (mixture_of(naive, careful), mixture_of(SumoDriver(), speedy))
    arm = SeatedArm(name="lawful", scene=scene, drivers=drivers, seed=start_seed)
    payoffs = [game.record["non_ego_payoff"] for game in assess(arm, episodes)]
    routes = scene.world.road.routes
    return float(np.mean(payoffs)), float(routes.speed_limit_mps[routes.first_row[1]])


if __name__ == "__main__":
    typer.run(main)
