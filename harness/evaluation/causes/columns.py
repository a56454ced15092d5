"""The columns of `causes.csv`: a row for each game that the ego failed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from harness.evaluation.causes.find import Cause

CAUSE_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "episode": "int64",
    "ego_outcome": "object",
    "other": "object",
    "deed": "object",
    "time_s": "float64",
    "time_left_s": "float64",
    "ego_saw": "object",
    "hidden_until_s": "float64",
    "reaction": "object",
    "braking_mps2": "float64",
    "ego_broke": "object",
}
"""Each with its pandas dtype. `docs/causes.md` describes them."""


def cells_of(cause: Cause) -> Mapping[str, Any]:
    """The cells of a cause."""
    saw = "" if cause.ego_saw is None else ("yes" if cause.ego_saw else "no")
    return {**vars(cause), "ego_saw": saw}
