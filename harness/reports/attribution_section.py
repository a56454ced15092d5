"""The section on attribution: which trait of each persona makes the ego fail, in a sentence and a table per persona."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pandas as pd

from harness.config.traits import TRAITS
from harness.evaluation.competence import ALL_TRAITS
from harness.evaluation.strategies import NaiveEgo, against_persona
from harness.reports.embedding import key
from harness.reports.figures import GAME
from harness.reports.game_links import GameLinks
from harness.reports.numbers import MISSING, NO_SPACE, p_number, signed
from harness.reports.run_tables import Row, RunTables
from harness.reports.verdict_wording import as_sentence

COUNTS = ("without_pairs", "failures", "failures_without", "alone_pairs", "failures_baseline", "failures_alone")

_UNDECIDED = {
    "last_second": "in the last second",
    "since_conflict": "since the conflict began",
    "all_game": "in the whole game",
}
"""When a person decided nothing, by the columns of the table `undecided`."""


def attribution_section(tables: RunTables, links: GameLinks) -> list[dict[str, Any]]:
    """What the template shows for each persona: `lines`, each with its text and the address of a pair of games to watch
    (empty without one), and the `rows` of its table. Empty without `[attribution]`."""
    return [
        {
            "persona": persona,
            "baseline": tables.manifest.get("baseline", "the baseline"),
            "lines": list(_lines(persona, rows, tables, links)),
            "rows": [_cells(row) for row in rows.to_dict("records")],
        }
        for persona, rows in tables.attribution.groupby("persona", sort=False)
    ]


def trait_words(trait: str) -> str:
    return "all traits" if trait == ALL_TRAITS else TRAITS[trait].words


def _lines(persona: str, rows: pd.DataFrame, tables: RunTables, links: GameLinks) -> Iterator[dict[str, str]]:
    answered, several = rows[rows["reason"] == ""], rows["seed"].nunique() > 1
    for reason, of_reason in rows[rows["reason"] != ""].groupby("reason", sort=False):
        seeds = ", ".join(map(str, of_reason["seed"].unique()))
        for_seeds = f" for training seed {seeds}" if several else ""
        yield {"text": f"Not answered{for_seeds}: {as_sentence(str(reason))}", "game": ""}
    counts = answered[answered["trait"] != ALL_TRAITS].groupby("trait", sort=False)[list(COUNTS)].sum()
    caused = counts["failures"] - counts["failures_without"]
    if len(caused):
        best = str(caused.idxmax())
        of_best = answered[answered["trait"] == best]
        text = _sentence(persona, best, counts.loc[best].to_dict(), of_best, tables)
        yield {"text": text, "game": _pair_address(of_best, links)}
    if undecided := _undecided(persona, tables):
        yield {"text": undecided, "game": ""}


def _sentence(persona: str, trait: str, counts: Row, rows: pd.DataFrame, tables: RunTables) -> str:
    """What the trait with the most failures does, over all training seeds."""
    baseline, words, seeds = tables.manifest.get("baseline", "the baseline"), trait_words(trait), len(rows)
    games = f"{counts['without_pairs']} games" + (f" of {seeds} trainings" if seeds > 1 else "")
    failures, without = counts["failures"], counts["failures_without"]
    if not failures:
        return f"Against {persona} the {tables.naive} fails in none of {games}: no trait causes failures."
    if without >= failures:
        same = f"the {tables.naive} fails in {failures} of {games} against {persona}"
        return f"No trait by itself: {same}, and in no fewer with any one trait of {baseline} instead."
    text = (
        f"With the {words} of {baseline}, {persona} makes the {tables.naive} fail in {without} of {games} instead of "
        f"{failures}. "
    )
    significance = tables.significance if tables.significance is not None else 0.0
    significant = int((rows["without_p_holm"] < significance).sum())
    if seeds > 1:
        text += f"The difference is significant in {significant} of {seeds} trainings. "
    elif not significant:
        text += "The difference can be chance. "
    return text + (
        f"With the {words} of {persona}, {baseline} makes it fail in {counts['failures_alone']} of "
        f"{counts['alone_pairs']} instead of {counts['failures_baseline']}."
    )


def _undecided(persona: str, tables: RunTables) -> str:
    """In how many failures of the naive ego a persona decided nothing; empty where there are none."""
    arm = against_persona(NaiveEgo(), persona).name
    counts = tables.undecided[tables.undecided["arm"] == arm].sum(numeric_only=True)
    found = [(int(counts[f"undecided_{when}"]), words) for when, words in _UNDECIDED.items()]
    found = [(count, words) for count, words in found if count]
    if not found:
        return ""
    (first, when), *others = found
    rest = "".join(f", in {count} {words}" for count, words in others)
    failures = int(counts["failures"])
    return f"In {first} of {failures} failures {persona} decided nothing {when}{rest}: its attention had lapsed."


def _pair_address(rows: pd.DataFrame, links: GameLinks) -> str:
    """The address of a game with a trait, beside that without it; empty where the page does not contain the first."""
    for row in rows[rows["example"].notna()].to_dict("records"):
        own, other = (key(row[arm], row["seed"], int(row["example"])) for arm in ("arm", "without_arm"))
        if own in links.embedded:
            return f"{GAME}{own}" + (f"&with={other}" if other in links.embedded else "")
    return ""


def _cells(row: Row) -> dict[str, Any]:
    return {
        "trait": trait_words(row["trait"]),
        "seed": row["seed"],
        "cells": [
            *(_of(row[name], row["without_pairs"]) for name in ("failures", "failures_without")),
            *(_caused(row, "without"), p_number(row["without_p_holm"])),
            *(_of(row[name], row["alone_pairs"]) for name in ("failures_baseline", "failures_alone")),
            *(_caused(row, "alone"), p_number(row["alone_p_holm"])),
        ],
    }


def _of(count: Any, games: Any) -> str:
    return MISSING if pd.isna(count) else f"{count}{NO_SPACE}of{NO_SPACE}{games}"


def _caused(row: Row, name: str) -> str:
    """A difference in percentage points, with its interval if it has one."""
    value, low, high = (100.0 * row[f"{name}_difference{end}"] for end in ("", "_low", "_high"))
    if not math.isfinite(value):
        return MISSING
    span = f" ({signed(low, 1)}{NO_SPACE}to{NO_SPACE}{signed(high, 1)})" if math.isfinite(low) else ""
    return f"{signed(value, 1)}{NO_SPACE}points{span}"
