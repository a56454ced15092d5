"""A run of docs/reproduction/ten-seeds.toml, seed by seed, against what protocol.toml expects of it.

    python docs/reproduction/findings.py reports/ten-seeds

prints the table of docs/reproduction.md from the CSV files of the run folder. It refuses a run with other training
seeds, or of personas or a scene with other hashes, than the protocol names.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import pandas as pd
import typer
from pydantic import Field, model_validator

from harness.config.toml_reading import Document, read_document

PROTOCOL = Path(__file__).with_name("protocol.toml")


class Expected(Document):
    """One expectation: a quantity of a training seed, and the range in which it is to be."""

    quantity: Literal["failures", "speed_change", "goals", "p_holm"]
    """The share of games in which the ego fails; the change of its mean speed against naive_alone; the share of games
    in which the person reaches its goal; the p-value of the question about failures, after Holm's correction."""
    arm: str = ""
    question: str = ""
    persona: str = ""
    least: float | None = None
    most: float | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Expected:
        if (self.quantity == "p_holm") != bool(self.question and self.persona) or bool(self.arm) == bool(self.question):
            raise ValueError("p_holm has `question` and `persona`, each other quantity has `arm`")
        if self.least is None and self.most is None:
            raise ValueError("nothing is expected: give `least` or `most`")
        return self

    @property
    def what(self) -> str:
        """In words."""
        words = {"failures": "failures", "speed_change": "speed against naive_alone", "goals": "the person's goal"}
        return f"{self.arm}: {words[self.quantity]}" if self.arm else f"{self.question} {self.persona}: p after Holm"

    @property
    def bound(self) -> str:
        """The range in words."""
        least, most = (None if end is None else self.shown(end) for end in (self.least, self.most))
        if least is None or most is None:
            return f"at least {least}" if most is None else f"at most {most}"
        return f"{least} to {most}"

    def value(self, episodes: pd.DataFrame, comparisons: pd.DataFrame) -> float:
        """The quantity in the tables of one training seed."""
        games = episodes[(episodes["arm"] == self.arm) & episodes["error"].isna()]
        match self.quantity:
            case "failures":
                return float(games["ego_failed"].mean())
            case "speed_change":
                alone = episodes[(episodes["arm"] == "naive_alone") & episodes["error"].isna()]
                return float(games["ego_mean_speed_mps"].mean() / alone["ego_mean_speed_mps"].mean()) - 1.0
            case "goals":
                return float((episodes.loc[episodes["arm"] == self.arm, "non_ego_outcome"] == "goal").mean())
            case "p_holm":
                rows = comparisons[comparisons["metric"] == "failure"].set_index(["question", "persona"])
                return float(rows.loc[(self.question, self.persona), "p_holm"])

    def holds(self, value: float) -> bool:
        """Whether a value is in the range. A test that could not be made, NaN, is not."""
        least, most = (-float("inf") if self.least is None else self.least, self.most)
        return bool(least <= value <= (float("inf") if most is None else most))

    def shown(self, value: float) -> str:
        """A value of the quantity as text."""
        match self.quantity:
            case "p_holm":
                return f"{value:.2g}"
            case "speed_change":
                return f"{value:+.1%}"
            case _:
                return f"{value:.0%}"


class Protocol(Document):
    """The document protocol.toml."""

    seeds: list[int]
    sha256: dict[str, str]
    """By the name of a file that the run reads."""
    expected: list[Expected] = Field(min_length=1)

    def deviations(self, manifest: dict[str, object]) -> Iterator[str]:
        """In what a run is not the one that the protocol is about."""
        if manifest["seeds"] != self.seeds:
            yield f"training seeds {manifest['seeds']}, the protocol has {self.seeds}"
        hashes = {Path(name).name: value for name, value in dict(manifest["hashes"]).items()}  # type: ignore[call-overload]
        for name, value in self.sha256.items():
            if hashes.get(name) != value:
                yield f"{name} has SHA-256 {hashes.get(name)}, the protocol has {value}"


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="The run folder, such as reports/ten-seeds.")],
) -> None:
    """Print what was expected and what was found as Markdown, a column per training seed."""
    protocol = read_document(PROTOCOL, Protocol)
    if deviations := list(protocol.deviations(json.loads((run / "manifest.json").read_text(encoding="utf-8")))):
        sys.exit("\n".join(f"{run}: {each}" for each in deviations))
    games = run / "episodes.csv"
    games = games if games.is_file() else run / "episodes.csv.gz"  # as it is published
    table = findings(protocol, pd.read_csv(games), pd.read_csv(run / "comparisons.csv"))
    seeds = [f"seed_{seed}" for seed in protocol.seeds]
    print("| quantity | expected | " + " | ".join(name.replace("_", " ") for name in seeds) + " | held |")
    print("| --- | --- |" + " --- |" * (len(seeds) + 1))
    for expected, row in zip(protocol.expected, table.to_dict("records"), strict=True):
        shown = " | ".join(expected.shown(row[name]) for name in seeds)
        print(f"| {row['what']} | {row['expected']} | {shown} | {row['held']} of {len(seeds)} |")


def findings(protocol: Protocol, episodes: pd.DataFrame, comparisons: pd.DataFrame) -> pd.DataFrame:
    """A row for each expectation: its value for each training seed, and in how many it holds."""
    rows = []
    for expected in protocol.expected:
        values = {
            f"seed_{seed}": expected.value(episodes[episodes["seed"] == seed], comparisons[comparisons["seed"] == seed])
            for seed in protocol.seeds
        }
        held = sum(map(expected.holds, values.values()))
        rows.append({"what": expected.what, "expected": expected.bound, **values, "held": held})
    return pd.DataFrame(rows)


if __name__ == "__main__":
    typer.run(main)
