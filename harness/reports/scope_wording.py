"""What a verdict holds for, in words: this trained pair, or trainings like this; and of how many planned tests it is
one."""

from __future__ import annotations

import pandas as pd

from harness.evaluation.competence import Verdict
from harness.evaluation.planned_tests import LEAST_TRAININGS, PRIMARY, About
from harness.reports.differences import CHANCE, effect, p_values
from harness.reports.numbers import trimmed
from harness.reports.run_tables import Row, RunTables

TOO_FEW_TRAININGS = f"trainings like this need {LEAST_TRAININGS} training seeds"


def scope_of(about: About | None, planned: int, seeds: int) -> str:
    """What a verdict of a campaign with this many training seeds is about, as a sentence; empty for None."""
    if about is None:
        return ""
    too_few = f"; {TOO_FEW_TRAININGS}" if seeds < LEAST_TRAININGS else ""
    return f"About {about.value}, one of {planned} planned test{'' if planned == 1 else 's'}{too_few}."


def planned_in_words(tables: RunTables) -> str:
    """The sizes of the families of Holm's correction; empty without tests."""
    parts = []
    for about, frame in ((About.TRAINED_PAIR, tables.comparisons), (About.TRAININGS, tables.over_trainings)):
        planned = frame["planned_tests"].max() if len(frame) else pd.NA
        if not pd.isna(planned):
            parts.append(f"{planned} planned test{'' if planned == 1 else 's'} about {about.value}")
    return ", and by itself over ".join(parts)


def over_trainings_sentence(row: Row, tables: RunTables, who: str) -> str:
    """A row of `over_trainings` in words."""
    if row["verdict"] == Verdict.NOT_ENOUGH_TRAININGS:
        asked = row["trainings"] + row["trainings_left_out"]
        return f"The question is answered for {row['trainings']} of {asked} trainings, and {TOO_FEW_TRAININGS}."
    sides = {
        "RQ1": f"the {tables.naive} against {who}, compared with alone",
        "RQ2": f"the {tables.change.made} ego against {who}, compared with the {tables.naive}",
    }[row["question"]]
    found = f"Over {row['trainings']} trainings, {sides}: {_difference(row)}"
    match Verdict(row["verdict"]):
        case Verdict.SIGNIFICANT:
            return f"{found}."
        case Verdict.BEFORE_HOLM_ONLY:
            return f"{found}: significant without correction, but not after Holm's correction."
        case Verdict.NOT_SIGNIFICANT:
            return f"{found}: {CHANCE}."
        case _:
            return f"{found}: there is nothing to test."


def over_trainings_statistics(row: Row) -> str:
    """The test of a row of `over_trainings` as one line."""
    return f"{row['question']}, over {row['trainings']} trainings. Failures: {_difference(row)}; {p_values(row)}."


def _difference(row: Row) -> str:
    if pd.isna(row["mean_difference"]):
        return "no pairs"
    ends = [row["least"], row["most"]] if row["mean_difference"] >= 0 else [-row["most"], -row["least"]]
    low, high = (trimmed(100 * end, 1) for end in ends)
    return f"{effect({**row, 'metric': PRIMARY})}, single trainings {low} to {high}"
