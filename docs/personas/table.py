"""The table of docs/personas-on-the-merge.md: training, characteristic and effect of every persona of a run.

    python docs/personas/table.py reports/merge-personas

reads the CSV files, traces and scene of the run folder; no game is played.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from measures import (
    PersonGame,
    lane_left_m,
    lapse_s,
    lateral_deviation_m,
    reaction_s,
    speed_over_limit,
    time_gap_s,
)

from harness.evaluation.trace_file import read_traces
from harness.road.scene.open_scene import OpenScene, open_scene

LEARNED = ("naive", "retrained", "robust")  # the egos that a campaign trains
LAST_WINDOWS = 3  # windows of the learning curve for the payoff at the end


@dataclass(frozen=True, kw_only=True)
class Characteristic:
    """A quantity that distinguishes a persona, measured in the games of an arm, and published data about people."""

    name: str
    arm: str
    measure: Callable[[Sequence[PersonGame]], float]
    format: str
    people: str
    low: float
    high: float
    """The expected range of the value is `low` to `high`."""
    baseline: str = ""
    """The persona with the value that is subtracted; empty if there is none."""


ALONE, AGAINST_NAIVE = "{}_alone", "naive_vs_{}"
CHARACTERISTICS: dict[str, Characteristic] = {
    "careful": Characteristic(
        name="speed against the limit, alone",
        arm=ALONE,
        measure=speed_over_limit,
        format="{:+.1%}",
        people="the limit",
        low=-0.1,
        high=0.01,
    ),
    "cautious": Characteristic(
        name="median time gap behind the naive ego",
        arm=AGAINST_NAIVE,
        measure=time_gap_s,
        format="{:.2f} s",
        people="2 s or more: 49.4 % of urban drivers (Michael, Leeming and Dwyer 2000)",
        low=2.0,
        high=np.inf,
    ),
    "speedy": Characteristic(
        name="speed against the limit, alone",
        arm=ALONE,
        measure=speed_over_limit,
        format="{:+.1%}",
        people="15 mph over on a freeway: 45 % of drivers within a month (AAA Foundation 2021)",
        low=0.05,
        high=0.3,
    ),
    "tailgater": Characteristic(
        name="median time gap behind the naive ego",
        arm=AGAINST_NAIVE,
        measure=time_gap_s,
        format="{:.2f} s",
        people="less than 1 s: 7.3 % of urban drivers (Michael, Leeming and Dwyer 2000)",
        low=0.1,
        high=1.0,
    ),
    "late_merger": Characteristic(
        name="rest of the ending lane when it crosses the line, against the naive ego",
        arm=AGAINST_NAIVE,
        measure=lane_left_m,
        format="{:.1f} m",
        people="most merge near the middle of an acceleration lane (Li, Wang, Chen and Li 2007)",
        low=-30.0,
        high=0.0,
    ),
    "texting": Characteristic(
        name="mean lapse, alone",
        arm=ALONE,
        measure=lapse_s,
        format="{:.1f} s",
        people="5 s to read or send a text (NHTSA)",
        low=4.0,
        high=6.0,
    ),
    "drowsy": Characteristic(
        name="mean time to the first movement of pedal or wheel, alone",
        arm=ALONE,
        measure=reaction_s,
        format="{:.2f} s",
        people="alert and expecting: 0.70 to 0.75 s; surprised: 1.5 s (Green 2000)",
        low=0.75,
        high=2.5,
    ),
    "impaired": Characteristic(
        name="standard deviation of lateral position, alone, over the careful driver's",
        arm=ALONE,
        measure=lateral_deviation_m,
        format="{:+.2f} m",
        people="+0.02 to +0.03 m at 0.5 g/L of blood alcohol (Jongen et al. 2017)",
        low=0.02,
        high=0.3,
        baseline="careful",
    ),
}


# --- the table --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Run:
    """The tables and traces of one training seed of a run folder."""

    folder: Path
    seed: int
    episodes: pd.DataFrame
    training: pd.DataFrame
    scene: OpenScene

    @classmethod
    def read(cls, folder: Path, seed: int | None) -> Run:
        """The games of a training seed; None: of the first one."""
        episodes, training = (pd.read_csv(folder / f"{name}.csv") for name in ("episodes", "training"))
        seed = int(episodes["seed"].min()) if seed is None else seed
        return cls(
            folder=folder,
            seed=seed,
            episodes=episodes[episodes["seed"] == seed],
            training=training[training["seed"] == seed],
            scene=open_scene(folder / "scene"),
        )

    @property
    def personas(self) -> list[str]:
        """The personas, in the order of the campaign."""
        return list(dict.fromkeys(self.episodes["persona"].dropna()))

    @property
    def egos(self) -> list[str]:
        """The egos against the personas, without the naive and the retrained ones."""
        arms = [arm.partition("_vs_") for arm in dict.fromkeys(self.episodes["arm"])]
        egos = (ego for ego, _, persona in arms if persona in self.personas and not ego.startswith(LEARNED))
        return list(dict.fromkeys(egos))

    def games(self, arm: str) -> pd.DataFrame:
        """The games of an arm, without those that could not be played."""
        return self.episodes[(self.episodes["arm"] == arm) & self.episodes["error"].isna()]

    def ego_result(self, arm: str) -> str:
        """Failure rate and mean speed of the ego; empty if there is no such arm."""
        games = self.games(arm)
        if games.empty:
            return ""
        return f"{games['ego_failed'].astype(float).mean():.0%}, {games['ego_mean_speed_mps'].mean():.2f} m/s"

    def failure_rate_alone(self, persona: str) -> str:
        """Rate of games in which the persona, alone on the road, does not reach its goal; empty if there are none."""
        games = self.games(f"{persona}_alone")
        return f"{(games['non_ego_outcome'] != 'goal').mean():.0%}" if len(games) else ""

    def payoffs_in_training(self, persona: str) -> str:
        """Mean payoff at the start and at the end of the training; empty if the run did not train the persona."""
        curve = self.training.loc[self.training["stage"] == persona, "mean_payoff"]
        return f"{curve.iloc[0]:.1f} → {curve.iloc[-LAST_WINDOWS:].mean():.1f}" if len(curve) else ""

    def value(self, characteristic: Characteristic, persona: str) -> float:
        """The value of a characteristic; NaN if the baseline is not in this run."""
        personas = [persona, characteristic.baseline] if characteristic.baseline else [persona]
        if not set(personas) <= set(self.personas):
            return float("nan")
        arms = [characteristic.arm.format(each) for each in personas]
        own, *baseline = (characteristic.measure(list(self.recorded_games(arm))) for arm in arms)
        return own - sum(baseline)

    def recorded_games(self, arm: str) -> Iterator[PersonGame]:
        """The recorded games of an arm."""
        for _, trace in read_traces(self.folder / "traces" / f"{arm}-seed{self.seed}.parquet"):
            yield PersonGame.of(trace, self.scene)


def rows(run: Run) -> list[dict[str, str]]:
    """The rows of the table; a cell without a value is empty."""
    return [row(run, persona) for persona in run.personas]


def row(run: Run, persona: str) -> dict[str, str]:
    """The row of a persona."""
    cells = {
        "persona": persona,
        "payoff in training": run.payoffs_in_training(persona),
        **dict.fromkeys(("characteristic", "value", "as expected", "people"), ""),
    }
    characteristic = CHARACTERISTICS.get(persona)
    if characteristic is not None:
        value = run.value(characteristic, persona)
        cells |= {"characteristic": characteristic.name, "people": characteristic.people}
        if not np.isnan(value):
            cells["value"] = characteristic.format.format(value)
            cells["as expected"] = "yes" if characteristic.low <= value <= characteristic.high else "no"
    cells |= {"fails alone": run.failure_rate_alone(persona), "naive ego": run.ego_result(f"naive_vs_{persona}")}
    cells |= {ego: run.ego_result(f"{ego}_vs_{persona}") for ego in run.egos}
    cells["retrained ego"] = run.ego_result(f"retrained_vs_{persona}")
    return cells


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder, such as reports/merge-personas.")],
    seed: Annotated[int | None, typer.Option(help="The training seed.  [default: the first one]")] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write the table as CSV.")] = None,
) -> None:
    """Print the table of personas as Markdown. The cells of an ego have its failure rate and its mean speed."""
    table = rows(Run.read(run, seed))
    print("| " + " | ".join(table[0]) + " |")
    print("| --- |" + " --- |" * (len(table[0]) - 1))
    for cells in table:
        print("| " + " | ".join(cells.values()) + " |")
    if out is not None:
        pd.DataFrame(table).to_csv(out, index=False)


if __name__ == "__main__":
    typer.run(main)
