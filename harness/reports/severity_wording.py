"""How severe the collisions of an ego are, in words."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.reports.numbers import NO_SPACE, number, percent
from harness.reports.run_tables import RunTables

SMALL_DELTA_V_MPS = 3.0
"""Below this change of velocity a collision is called small. Our own: just above 10 km/h."""
RISK_TONES = {
    "none": "no failure",
    "small": f"1{NO_SPACE}%",
    "medium": f"10{NO_SPACE}%",
    "severe": f"more than 10{NO_SPACE}%",
    "unknown": "no collision, or not known",
}
"""The colours of failures: the probability of a serious injury (MAIS3+) in a collision, by its upper bound."""
_ROUNDING = 1e-9
_RISK = "the probability of a serious injury (MAIS3+)"


def severity_clause(ego: str, arm: str, tables: RunTables) -> str:
    """Number, delta-v and risk of injury of the collisions of an ego ("naive ego") in an arm, over all training seeds;
    empty without a collision."""
    rows = [row for row in tables.rates_of(arm).values() if row["collisions"] and np.isfinite(row["max_delta_v_mps"])]
    if not rows:
        return ""
    counts = [int(row["collisions"]) for row in rows]
    collisions, most_mps = sum(counts), max(row["max_delta_v_mps"] for row in rows)
    which = f"all {collisions:,} collisions" if collisions > 1 else "the only collision"
    have = "have" if collisions > 1 else "has"
    if most_mps < SMALL_DELTA_V_MPS:
        words = f"{which} of the {ego} {have} a delta-v below {SMALL_DELTA_V_MPS:g}{NO_SPACE}m/s"
    else:
        mean_mps = np.average([row["delta_v_mps"] for row in rows], weights=counts)
        means = f"{number(mean_mps, 1)}{NO_SPACE}m/s on average, " if collisions > 1 else ""
        words = f"{which} of the {ego}: delta-v {means}at most {number(most_mps, 1)}{NO_SPACE}m/s"
    return f"{words}{_risk(tables.games_of(arm))}"


def risk_tone(risk: float) -> str:
    """The key of `RISK_TONES` of an upper bound of the probability in a failure; NaN: it is not known. A mean of equal
    bounds may be above them in its last bits."""
    if not np.isfinite(risk):
        return "unknown"
    return "small" if risk <= 0.01 + _ROUNDING else "medium" if risk <= 0.1 + _ROUNDING else "severe"


def _risk(games: pd.DataFrame) -> str:
    """The bounds of the mean over the collisions in which they are known, as a clause; empty if they are in none."""
    low, high = (games[f"mais3_risk_{end}"].mean() for end in ("low", "high"))
    if np.isnan(high):
        return ""
    if low > 0.0:
        return f"; {_RISK} is {percent(low)} to {percent(high)} (bounds of the mean)"
    return f"; {_RISK} is at most {percent(high)}"
