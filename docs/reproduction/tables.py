"""The table of the levers in docs/reproduction-assumptions.md, as Markdown.

python docs/reproduction/tables.py docs/reproduction/levers.csv
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer


def main(file: Annotated[Path, typer.Argument(metavar="FILE", help="The table that sweep.py wrote.")]) -> None:
    """Print a row for each setting of a lever."""
    found = pd.read_csv(file, dtype={"value": str})
    header = [
        "persona",
        "key",
        "value",
        "naive ego fails",
        "persona reaches its goal",
        "persona alone reaches its goal",
    ]
    rows = []
    for (persona, key, value), of_setting in found.groupby(["persona", "key", "value"], sort=False):
        arms = of_setting.set_index("arm")
        tested, alone, retrained = (
            arms.loc[arm] for arm in (f"naive_vs_{persona}", f"{persona}_alone", f"retrained_vs_{persona}")
        )
        shares = [tested["failure_rate"], tested["non_ego_goal_rate"], alone["non_ego_goal_rate"]]
        shares.append(retrained["failure_rate"])
        rates = [f"{share:.0%}".replace("%", " %") for share in shares]
        rows.append([persona, f"`{key}`", value, *rates, f"{retrained['mean_speed_mps']:.2f}"])
    print(_table([*header, "retrained ego fails", "retrained ego's speed, m/s"], rows))


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


if __name__ == "__main__":
    typer.run(main)
