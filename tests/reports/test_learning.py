"""The learning curves: the events of a training."""

from __future__ import annotations

from typing import Any

from harness.evaluation.strategies import PersonaNonEgo, RetrainedEgo
from harness.reports.learning import LAPSES_BEGIN, NARROWS, learning
from harness.reports.run_tables import RunTables
from tests.support.pages import blank_figures, campaign


def events(*, seeds: tuple[int, ...] = (1,), **entry: Any) -> dict[str, list[str]]:
    """The events of each training of a campaign of `texting`; `entry` is what its stages say otherwise."""
    arguments = campaign(personas=["texting"], seeds=seeds, games=4)
    manifest = arguments["manifest"]
    manifest["persona_documents"] = {"texting": {"attention": {"mean_attentive_s": 5.0}}}
    for name, stage in manifest["stages"].items():
        if stage["kind"] == "training":
            stage |= {"persona": "" if name.startswith("naive") else "texting"} | entry
    with blank_figures():
        return {each["stage"]: each["events"] for each in learning(RunTables(**arguments))}


def test_events__are_the_first_lapses_of_a_person_and_the_last_part_of_a_training() -> None:
    found = events(steps=3_000_000, stopped="budget")
    assert found == {
        "naive": [f"{NARROWS} at 2.7 M"],
        "texting": [f"{LAPSES_BEGIN} at 1.5 M", f"{NARROWS} at 2.7 M"],
        "retrained_texting": [f"{NARROWS} at 2.7 M"],  # its lapses are those of the other
    }


def test_events__of_a_training_that_converged_lie_before_its_end() -> None:
    assert events(steps=2_000_000, stopped="converged")["texting"] == [
        f"{LAPSES_BEGIN} at 1.5 M",
        f"{NARROWS} at 1.7 M",
    ]
    assert events(steps=1_000_000, stopped="converged")["texting"] == [f"{NARROWS} at 700 k"]
    assert events(steps=1_000_000, stopped="budget")["texting"] == []  # stopped before both


def test_events__of_several_seeds_are_told_once_where_they_are_the_same() -> None:
    assert events(seeds=(1, 2), steps=3_000_000, stopped="budget")["texting"] == [
        f"{LAPSES_BEGIN} at 1.5 M",
        f"{NARROWS} at 2.7 M",
    ]


def test_figure__marks_the_events() -> None:
    arguments = campaign(personas=["texting"], games=4)
    strategies = {"texting": PersonaNonEgo(persona="texting"), "retrained_texting": RetrainedEgo(against="texting")}
    arguments["strategies"] |= strategies
    (naive, *_) = learning(RunTables(**arguments))
    assert naive["figure"].count("stroke-dasharray") > 0
