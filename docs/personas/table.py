"""The table of docs/personas.md: training, characteristic and effect of every persona of a run.

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

from harness.evaluation.trace_file import read_traces
from harness.evaluation.trace_quantities import drove_in, quantities_of
from harness.game.arrays import BoolArray, FloatArray
from harness.game.quantities import Quantities, World
from harness.game.state import NON_EGO
from harness.replay.vehicles import types_of_vehicles
from harness.traffic.scene import OpenScene, open_scene

LEARNED = ("naive", "retrained", "robust")  # the egos that a campaign trains
LAST_WINDOWS = 3  # windows of the learning curve for the payoff at the end


@dataclass(frozen=True, kw_only=True)
class RecordedGame:
    """A recorded game and its non-ego: arrays are [T] over the steps, the start included."""

    quantities: Quantities
    drove: BoolArray
    """Whether the non-ego was driving: its game had not ended."""

    @classmethod
    def of(cls, trace: pd.DataFrame, scene: OpenScene) -> RecordedGame:
        """The game of a trace."""
        sizes_m = {
            name: (each.length_m, each.width_m) for name, each in types_of_vehicles(trace, scene.routes.path).items()
        }
        quantities = quantities_of(trace, scene.world, sizes_m)
        return cls(quantities=quantities, drove=drove_in(trace)[:, NON_EGO])

    @property
    def world(self) -> World:
        return self.quantities.world

    def while_driving(self, values: FloatArray) -> FloatArray:
        """The values of the non-ego in [T, P], in the steps in which it drove."""
        return values[self.drove, NON_EGO]


@dataclass(frozen=True, kw_only=True)
class Characteristic:
    """A quantity that distinguishes a persona, measured in the games of an arm, and published data about people."""

    name: str
    arm: str
    measure: Callable[[Sequence[RecordedGame]], float]
    format: str
    people: str
    low: float
    high: float
    """The expected range of the value is `low` to `high`."""
    baseline: str = ""
    """The persona with the value that is subtracted; empty if there is none."""


# --- measures ---------------------------------------------------------------------------------------------------------


def speed_over_limit(games: Sequence[RecordedGame]) -> float:
    """Mean of the speed over the limit, as a share of the limit."""
    return float(np.mean(np.concatenate([game.while_driving(game.quantities.speed_over_limit) for game in games])))


def time_gap_s(games: Sequence[RecordedGame]) -> float:
    """Median of the time gap, in the steps with a car ahead."""
    gaps = np.concatenate([game.while_driving(game.quantities.time_gap_s) for game in games])
    return float(np.median(gaps[np.isfinite(gaps)]))


def reaction_s(games: Sequence[RecordedGame]) -> float:
    """Mean time from the start of a game to the first movement of pedal or wheel by the driver. 0 stands for a movement
    in the first step."""
    times_s = []
    for game in games:
        state = game.quantities.state
        moved = (state.acceleration_mps2[:, NON_EGO] != 0.0) | (state.steering_rad[:, NON_EGO] != 0.0)
        steps = np.flatnonzero(moved & ~state.lapsed[:, NON_EGO].astype(bool) & game.drove)
        if len(steps):
            times_s.append((steps[0] - 1) * game.world.step_s)  # a row is the end of its step; row 0 is the start
    return float(np.mean(times_s))


def lapse_s(games: Sequence[RecordedGame]) -> float:
    """Mean length of the lapses that begin and end within a game. This underestimates the mean: a long lapse is more
    often cut off by the end of a game."""
    lengths = []
    for game in games:
        lapsed = game.quantities.state.lapsed[game.drove, NON_EGO].astype(int)
        lapsed[0] = lapsed[1]  # row 0 has no decision; a lapse in row 1 began before the game
        begins, ends = (np.flatnonzero(np.diff(lapsed) == step) for step in (1, -1))
        ends = ends[ends > begins[0]] if len(begins) else ends[:0]
        lengths += [float(end - begin) * game.world.step_s for begin, end in zip(begins, ends, strict=False)]
    return float(np.mean(lengths)) if lengths else float("nan")


def lane_left_m(games: Sequence[RecordedGame]) -> float:
    """Median of the rest of the ending lane when the car's centre crosses the line to the next lane; negative in the
    taper."""
    rests_m = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        row = q.world.road.routes.rows(q.state.station_m)[0, NON_EGO]
        lanes, ends = routes.lane_offset_m[row], routes.lane_end_m[row]
        own = int(np.nanargmin(np.abs(lanes - q.lateral_offset_m[0, NON_EGO])))
        if not np.isfinite(ends[own]):
            continue  # the lane of the start goes on
        beside = min((k for k in range(len(lanes)) if np.isinf(ends[k])), key=lambda k: abs(lanes[k] - lanes[own]))
        line_m = 0.5 * (lanes[own] + lanes[beside])
        over = np.sign(q.lateral_offset_m[:, NON_EGO] - line_m) == np.sign(lanes[beside] - line_m)
        if (crossed := np.flatnonzero(over & game.drove)).size:
            rests_m.append(float(ends[own] - q.state.station_m[crossed[0], NON_EGO]))
    return float(np.median(rests_m)) if rests_m else float("nan")


def lateral_deviation_m(games: Sequence[RecordedGame]) -> float:
    """Standard deviation of lateral position (SDLP) of all games, where the road has its final width."""
    parts = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        rows = slice(routes.first_row[NON_EGO], routes.last_row[NON_EGO] + 1)
        has_final_width = (routes.left_edge_m[rows] == routes.left_edge_m[rows][-1]) & (
            routes.right_edge_m[rows] == routes.right_edge_m[rows][-1]
        )
        others = np.flatnonzero(~has_final_width)
        from_row = routes.first_row[NON_EGO] + (others[-1] + 1 if len(others) else 0)
        measured = (routes.rows(q.state.station_m)[:, NON_EGO] >= from_row) & game.drove
        parts.append(q.lateral_offset_m[measured, NON_EGO])
    offsets = np.concatenate(parts)
    return float(offsets.std()) if len(offsets) else float("nan")


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
    "distracted": Characteristic(
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
    def read(cls, folder: Path, seed: int) -> Run:
        episodes, training = (pd.read_csv(folder / f"{name}.csv") for name in ("episodes", "training"))
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

    def recorded_games(self, arm: str) -> Iterator[RecordedGame]:
        """The recorded games of an arm."""
        for _, trace in read_traces(self.folder / "traces" / f"{arm}-seed{self.seed}.parquet"):
            yield RecordedGame.of(trace, self.scene)


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
    seed: Annotated[int, typer.Option(help="The training seed.")] = 1,
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
