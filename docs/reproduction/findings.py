"""What a run of campaigns/merge-seeds.toml found, seed by seed, against what it was to find.

    python docs/reproduction/findings.py reports/merge-seeds

prints the table of docs/reproduction.md from the run folder's CSV files. Only the law-abiding driver in the speedy
driver's place is played here: SUMO drives the non-ego against each seed's naive ego, on the speedy driver's payoff.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import read_policy
from harness.drivers.sumo import SumoDriver
from harness.environments.rollout import Arm, assess
from harness.traffic.scene import open_scene

ROOT = Path(__file__).parents[2]
PERSONAS = ("speedy", "distracted")
ALPHA = 0.01


@dataclass(frozen=True)
class Tables:
    """A run's tables, of one training seed."""

    episodes: pd.DataFrame
    comparisons: pd.DataFrame
    lawful_payoff: float
    limit_mps: float

    def mean(self, arm: str, column: str) -> float:
        """Mean over the arm's episodes that were played."""
        rows = self.episodes[(self.episodes["arm"] == arm) & self.episodes["error"].isna()]
        return float(rows[column].astype(float).mean())

    def failures(self, arm: str) -> float:
        return self.mean(arm, "ego_failed")

    def speed(self, arm: str) -> float:
        return self.mean(arm, "ego_mean_speed_mps")

    def goals(self, arm: str) -> float:
        rows = self.episodes[self.episodes["arm"] == arm]
        return float((rows["non_ego_outcome"] == "goal").mean())

    def p(self, question: str, persona: str, column: str) -> float:
        """p of the question about failures, plain or corrected."""
        rows = self.comparisons
        rows = rows[(rows["question"] == question) & (rows["persona"] == persona) & (rows["metric"] == "failure")]
        return float(rows[column].iloc[0])


@dataclass(frozen=True)
class Finding:
    """A row: what is looked at, and what it was to be."""

    what: str
    bound: str
    value: Callable[[Tables], float]
    holds: Callable[[float], bool]
    form: str = "{:.0%}"


def findings() -> list[Finding]:
    """Every row, in the order of the page."""
    rows = [
        Finding("naive_alone: failures", "0", lambda t: t.failures("naive_alone"), lambda v: v == 0.0),
        Finding("naive_vs_sumo: failures", "≤ 3 %", lambda t: t.failures("naive_vs_sumo"), lambda v: v <= 0.03),
        Finding("naive_vs_speedy: failures", "≥ 20 %", lambda t: t.failures("naive_vs_speedy"), lambda v: v >= 0.20),
        Finding(
            "naive_vs_speedy: speed against naive_alone",
            "lower",
            lambda t: t.speed("naive_vs_speedy") / t.speed("naive_alone") - 1.0,
            lambda v: v < 0.0,
            "{:+.1%}",
        ),
        Finding(
            "retrained_vs_speedy: failures", "≤ 3 %", lambda t: t.failures("retrained_vs_speedy"), lambda v: v <= 0.03
        ),
        Finding(
            "retrained_vs_speedy: speed against naive_alone",
            "within 5 %",
            lambda t: t.speed("retrained_vs_speedy") / t.speed("naive_alone") - 1.0,
            lambda v: abs(v) <= 0.05,
            "{:+.1%}",
        ),
        Finding(
            "naive_vs_distracted: failures",
            "≥ 12 %",
            lambda t: t.failures("naive_vs_distracted"),
            lambda v: v >= 0.12,
        ),
        Finding(
            "retrained_vs_distracted: failures",
            "≤ 5 %",
            lambda t: t.failures("retrained_vs_distracted"),
            lambda v: v <= 0.05,
        ),
        *(
            Finding(f"retrained_alone_{p}: failures", "0", _failures(f"retrained_alone_{p}"), lambda v: v == 0.0)
            for p in PERSONAS
        ),
        Finding("speedy_alone: goal", "≥ 97 %", lambda t: t.goals("speedy_alone"), lambda v: v >= 0.97),
        Finding("distracted_alone: goal", "≥ 80 %", lambda t: t.goals("distracted_alone"), lambda v: v >= 0.80),
        Finding("naive_vs_speedy: its own goal", "≥ 60 %", lambda t: t.goals("naive_vs_speedy"), lambda v: v >= 0.60),
        Finding(
            "speedy_alone: speed against the limit",
            "+5 to +30 %",
            lambda t: t.mean("speedy_alone", "non_ego_mean_speed_mps") / t.limit_mps - 1.0,
            lambda v: 0.05 <= v <= 0.30,
            "{:+.1%}",
        ),
        Finding(
            "naive_vs_speedy: its payoff less a law-abiding driver's",
            "> 0",
            lambda t: t.mean("naive_vs_speedy", "non_ego_payoff") - t.lawful_payoff,
            lambda v: v > 0.0,
            "{:+.1f}",
        ),
    ]
    for question in ("RQ1", "RQ2"):
        for persona in PERSONAS:
            for column, word in (("p_value", "p"), ("p_holm", "Holm-corrected p")):
                rows.append(
                    Finding(
                        f"{question} {persona}: {word} of failure",
                        f"< {ALPHA}",
                        _p(question, persona, column),
                        lambda v: v < ALPHA,
                        "{:.2g}",
                    )
                )
    return rows


def _failures(arm: str) -> Callable[[Tables], float]:
    return lambda tables: tables.failures(arm)


def _p(question: str, persona: str, column: str) -> Callable[[Tables], float]:
    return lambda tables: tables.p(question, persona, column)


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder, such as reports/merge-seeds.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also written as CSV.")] = None,
) -> None:
    """Print the table of findings as Markdown, a column per training seed."""
    episodes, comparisons = pd.read_csv(run / "episodes.csv"), pd.read_csv(run / "comparisons.csv")
    seeds = sorted(episodes["seed"].unique())
    tables = {
        seed: Tables(
            episodes[episodes["seed"] == seed],
            comparisons[comparisons["seed"] == seed],
            *_lawful(run, int(seed), int((episodes["arm"] == "naive_alone").sum() / len(seeds))),
        )
        for seed in seeds
    }
    print("| what | was to be | " + " | ".join(f"seed {seed}" for seed in seeds) + " | held |")
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


def _lawful(run: Path, seed: int, episodes: int) -> tuple[float, float]:
    """Mean payoff, on the speedy driver's terms, of SUMO's driver in its place; and the speed limit."""
    scene = open_scene(ROOT / "networks" / "merge")
    careful, speedy = (read_document(ROOT / "personas" / f"{n}.toml", Persona) for n in ("careful", "speedy"))
    naive = LearnedDriver(read_policy(run / "policies" / f"naive-seed{seed}"), careful.decisions == "sampled")
    arm = Arm(name="lawful", scene=scene, drivers=(naive, SumoDriver()), personas=(careful, speedy), seed=seed)
    payoffs = [game.record["non_ego_payoff"] for game in assess(arm, episodes)]
    routes = scene.world.road.routes
    return float(np.mean(payoffs)), float(routes.speed_limit_mps[routes.first_row[1]])


if __name__ == "__main__":
    typer.run(main)
