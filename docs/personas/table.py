"""What every persona of a run learned, is and does, against what is known of people.

    python docs/personas/table.py reports/merge-personas

prints the table of docs/personas.md from the run folder's CSV files, traces and scene; nothing is played.
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
WINDOWS = 3  # of the learning curve, at its end


@dataclass(frozen=True)
class Played:
    """A recorded game, of which the non-ego is looked at: arrays are [T] over its steps, from the start on."""

    quantities: Quantities
    drove: BoolArray
    """Whether it was driving, while nothing had ended its game."""

    @classmethod
    def of(cls, trace: pd.DataFrame, scene: OpenScene) -> Played:
        """From the trace of one game."""
        sizes_m = {
            name: (each.length_m, each.width_m) for name, each in types_of_vehicles(trace, scene.routes.path).items()
        }
        return cls(quantities_of(trace, scene.world, sizes_m), drove_in(trace)[:, NON_EGO])

    @property
    def world(self) -> World:
        return self.quantities.world

    def while_driving(self, values: FloatArray) -> FloatArray:
        """The non-ego's part of [T, P], while it drove."""
        return values[self.drove, NON_EGO]


@dataclass(frozen=True)
class Trait:
    """What makes a person this one, measured in an arm's games, and what is known of people."""

    what: str
    arm: str
    measure: Callable[[Sequence[Played]], float]
    form: str
    people: str
    low: float
    high: float
    """The persona is itself from `low` to `high`."""
    over: str = ""
    """The persona whose own measure is subtracted."""


# --- measures ---------------------------------------------------------------------------------------------------------


def speed_over_limit(games: Sequence[Played]) -> float:
    """Mean speed over the limit, as a share of it."""
    return float(np.mean(np.concatenate([game.while_driving(game.quantities.speed_over_limit) for game in games])))


def time_gap_s(games: Sequence[Played]) -> float:
    """Median of the time gap, while there is somebody ahead."""
    gaps = np.concatenate([game.while_driving(game.quantities.time_gap_s) for game in games])
    return float(np.median(gaps[np.isfinite(gaps)]))


def reaction_s(games: Sequence[Played]) -> float:
    """Mean time from the start of a game, when the road comes into sight, to the first movement of pedal or wheel that
    is the driver's doing. 0: in the first step."""
    first = []
    for game in games:
        state = game.quantities.state
        moved = (state.acceleration_mps2[:, NON_EGO] != 0.0) | (state.steering_rad[:, NON_EGO] != 0.0)
        acts = np.flatnonzero(moved & ~state.lapsed[:, NON_EGO].astype(bool) & game.drove)
        if len(acts):
            first.append((acts[0] - 1) * game.world.step_s)  # a row is as of the end of its step; row 0 is the start
    return float(np.mean(first))


def lapse_s(games: Sequence[Played]) -> float:
    """Mean length of the lapses that begin and end within a game; longer ones have less of a chance to."""
    lengths = []
    for game in games:
        lapsed = game.quantities.state.lapsed[game.drove, NON_EGO].astype(int)
        lapsed[0] = lapsed[1]  # nobody has decided yet: who begins within a lapse was in it before
        begins, ends = (np.flatnonzero(np.diff(lapsed) == step) for step in (1, -1))
        ends = ends[ends > begins[0]] if len(begins) else ends[:0]
        lengths += [float(end - begin) * game.world.step_s for begin, end in zip(begins, ends, strict=False)]
    return float(np.mean(lengths)) if lengths else float("nan")


def lane_left_m(games: Sequence[Played]) -> float:
    """Median of what was left of the lane that ends, when the car's centre crossed the line to the lane beside it;
    negative: it was in the taper."""
    left = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        row = q.world.road.routes.rows(q.state.station_m)[0, NON_EGO]
        lanes, ends = routes.lane_offset_m[row], routes.lane_end_m[row]
        own = int(np.nanargmin(np.abs(lanes - q.lateral_offset_m[0, NON_EGO])))
        if not np.isfinite(ends[own]):
            continue  # its lane goes on
        beside = min((k for k in range(len(lanes)) if np.isinf(ends[k])), key=lambda k: abs(lanes[k] - lanes[own]))
        line_m = 0.5 * (lanes[own] + lanes[beside])
        over = np.sign(q.lateral_offset_m[:, NON_EGO] - line_m) == np.sign(lanes[beside] - line_m)
        if (crossed := np.flatnonzero(over & game.drove)).size:
            left.append(float(ends[own] - q.state.station_m[crossed[0], NON_EGO]))
    return float(np.median(left)) if left else float("nan")


def lateral_deviation_m(games: Sequence[Played]) -> float:
    """Standard deviation of lateral position (SDLP), over all games together, where the road is one lane for good."""
    found = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        rows = slice(routes.first_row[NON_EGO], routes.last_row[NON_EGO] + 1)
        as_at_end = (routes.left_edge_m[rows] == routes.left_edge_m[rows][-1]) & (
            routes.right_edge_m[rows] == routes.right_edge_m[rows][-1]
        )
        wide = np.flatnonzero(~as_at_end)
        from_row = routes.first_row[NON_EGO] + (wide[-1] + 1 if len(wide) else 0)
        there = (routes.rows(q.state.station_m)[:, NON_EGO] >= from_row) & game.drove
        found.append(q.lateral_offset_m[there, NON_EGO])
    offsets = np.concatenate(found)
    return float(offsets.std()) if len(offsets) else float("nan")


ALONE, AGAINST = "{}_alone", "naive_vs_{}"
TRAITS: dict[str, Trait] = {
    "careful": Trait("speed against the limit, alone", ALONE, speed_over_limit, "{:+.1%}", "the limit", -0.1, 0.01),
    "cautious": Trait(
        "median time gap behind the naive ego",
        *(AGAINST, time_gap_s, "{:.2f} s"),
        "2 s or more: 49.4 % of urban drivers (Michael, Leeming and Dwyer 2000)",
        *(2.0, np.inf),
    ),
    "speedy": Trait(
        "speed against the limit, alone",
        *(ALONE, speed_over_limit, "{:+.1%}"),
        "15 mph over on a freeway: 45 % of drivers within a month (AAA Foundation 2021)",
        *(0.05, 0.3),
    ),
    "tailgater": Trait(
        "median time gap behind the naive ego",
        *(AGAINST, time_gap_s, "{:.2f} s"),
        "less than 1 s: 7.3 % of urban drivers (Michael, Leeming and Dwyer 2000)",
        *(0.1, 1.0),
    ),
    "late_merger": Trait(
        "way left in the ending lane when it crosses the line, against the naive ego",
        *(AGAINST, lane_left_m, "{:.1f} m"),
        "most merge near the middle of an acceleration lane (Li, Wang, Chen and Li 2007)",
        *(-30.0, 0.0),
    ),
    "distracted": Trait(
        "mean lapse, alone",
        *(ALONE, lapse_s, "{:.1f} s"),
        "5 s to read or send a text (NHTSA)",
        *(4.0, 6.0),
    ),
    "drowsy": Trait(
        "mean time to the first movement of pedal or wheel, alone",
        *(ALONE, reaction_s, "{:.2f} s"),
        "alert and expecting: 0.70 to 0.75 s; surprised: 1.5 s (Green 2000)",
        *(0.75, 2.5),
    ),
    "impaired": Trait(
        "standard deviation of lateral position, alone, over the careful driver's",
        *(ALONE, lateral_deviation_m, "{:+.2f} m"),
        "+0.02 to +0.03 m at 0.5 g/L of blood alcohol (Jongen et al. 2017)",
        *(0.02, 0.3),
        over="careful",
    ),
}


# --- the table --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """A run folder's tables of one training seed, and its traces."""

    folder: Path
    seed: int
    episodes: pd.DataFrame
    training: pd.DataFrame
    scene: OpenScene

    @classmethod
    def read(cls, folder: Path, seed: int) -> Run:
        episodes, training = (pd.read_csv(folder / f"{name}.csv") for name in ("episodes", "training"))
        of_seed = training["seed"] == seed
        return cls(folder, seed, episodes[episodes["seed"] == seed], training[of_seed], open_scene(folder / "scene"))

    @property
    def personas(self) -> list[str]:
        """As the campaign orders them."""
        return list(dict.fromkeys(self.episodes["persona"].dropna()))

    @property
    def egos(self) -> list[str]:
        """Who else meets the personas, beside the naive and the retrained ego."""
        arms = [arm.partition("_vs_") for arm in dict.fromkeys(self.episodes["arm"])]
        others = (ego for ego, _, who in arms if who in self.personas and not ego.startswith(LEARNED))
        return list(dict.fromkeys(others))

    def games(self, arm: str) -> pd.DataFrame:
        """An arm's games that were played."""
        return self.episodes[(self.episodes["arm"] == arm) & self.episodes["error"].isna()]

    def fails(self, arm: str) -> str:
        """How often the ego fails, and its mean speed; empty: there is no such arm."""
        games = self.games(arm)
        if games.empty:
            return ""
        return f"{games['ego_failed'].astype(float).mean():.0%}, {games['ego_mean_speed_mps'].mean():.2f} m/s"

    def fails_alone(self, persona: str) -> str:
        """How often the person does not reach its goal, alone on the road."""
        games = self.games(f"{persona}_alone")
        return f"{(games['non_ego_outcome'] != 'goal').mean():.0%}" if len(games) else ""

    def learns(self, persona: str) -> str:
        """Mean payoff in the first stretch of the training, and in the last few; empty: it was not trained here."""
        curve = self.training.loc[self.training["stage"] == persona, "mean_payoff"]
        return f"{curve.iloc[0]:.1f} → {curve.iloc[-WINDOWS:].mean():.1f}" if len(curve) else ""

    def measured(self, trait: Trait, persona: str) -> float:
        """A trait of a persona; NaN: whoever it is compared with is not in this run."""
        whom = [persona, trait.over] if trait.over else [persona]
        if not set(whom) <= set(self.personas):
            return float("nan")
        own, *other = (trait.measure(list(self.played(trait.arm.format(each)))) for each in whom)
        return own - sum(other)

    def played(self, arm: str) -> Iterator[Played]:
        """An arm's recorded games."""
        for _, trace in read_traces(self.folder / "traces" / f"{arm}-seed{self.seed}.parquet"):
            yield Played.of(trace, self.scene)


def rows(run: Run) -> list[dict[str, str]]:
    """The table's rows: a cell is empty where there is nothing to tell."""
    found = []
    for persona in run.personas:
        trait = TRAITS.get(persona)
        row = {
            "persona": persona,
            "learns: payoff": run.learns(persona),
            "trait": "",
            "is": "",
            "itself": "",
            "people": "",
        }
        if trait is not None:
            value = run.measured(trait, persona)
            itself = "yes" if trait.low <= value <= trait.high else "no"
            shown = ("", "") if np.isnan(value) else (trait.form.format(value), itself)
            row |= {"trait": trait.what, "is": shown[0], "itself": shown[1], "people": trait.people}
        row |= {"alone: fails": run.fails_alone(persona), "naive ego": run.fails(f"naive_vs_{persona}")}
        row |= {ego: run.fails(f"{ego}_vs_{persona}") for ego in run.egos}
        row["retrained ego"] = run.fails(f"retrained_vs_{persona}")
        found.append(row)
    return found


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder, such as reports/merge-personas.")],
    seed: Annotated[int, typer.Option(help="The training seed.")] = 1,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Also written as CSV.")] = None,
) -> None:
    """Print the table of personas as Markdown. An ego's cells are how often it fails, and its mean speed."""
    table = rows(Run.read(run, seed))
    print("| " + " | ".join(table[0]) + " |")
    print("| --- |" + " --- |" * (len(table[0]) - 1))
    for row in table:
        print("| " + " | ".join(row.values()) + " |")
    if out is not None:
        pd.DataFrame(table).to_csv(out, index=False)


if __name__ == "__main__":
    typer.run(main)
