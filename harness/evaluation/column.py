"""A column of a table: what the registry (`columns.TABLES`) knows of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, replace

from harness.game.roles import role_in_words

TEXT, FLAG = "object", "bool"
COUNT, NUMBER, MAYBE = "int64", "float64", "Int64"
"""The pandas dtypes of columns; `MAYBE`: whole numbers or empty."""
SHARE, POINTS, P_VALUE, OF_METRIC = "share", "difference of shares", "p", "that of the metric"
"""Units that pages show in their own way: in percent, in percentage points, as a p-value, and by the row's metric."""
_UNITS = {"_per_s": "1/s", "_mps3": "m/s³", "_mps2": "m/s²", "_s2": "s²", "_mps": "m/s", "_m": "m", "_s": "s"}


@dataclass(frozen=True)
class Column:
    """A column: an empty cell means that it could not be measured."""

    name: str
    dtype: str
    meaning: str
    """What it is, with its formula; a sentence."""
    _: KW_ONLY
    unit: str = ""
    """By default that of the name's ending, such as `_mps`."""
    source: str = ""
    """Where the definition comes from; empty: our own."""
    label: str = ""
    """Its heading on pages; by default its name in words."""
    optional: bool = False
    """Whether a table in which every cell of it would be empty is without the column."""

    def __post_init__(self) -> None:
        if not self.unit:
            unit = next((unit for ending, unit in _UNITS.items() if self.name.endswith(ending)), "")
            object.__setattr__(self, "unit", unit)

    @property
    def words(self) -> str:
        """The heading on pages, without the unit."""
        if self.label:
            return self.label
        ending = next((ending for ending in _UNITS if self.name.endswith(ending)), "")
        words = self.name.removesuffix(ending).replace("_ttc", "_time_to_collision")
        words = role_in_words(words)
        return words.replace(" low", ", 95 % low").replace(" high", ", 95 % high")

    def with_interval(self, interval: str) -> Iterator[Column]:
        """The column and the two of its interval."""
        yield self
        for end in ("low", "high"):
            what = f"The {end} end of the {interval} of {self.name}."
            yield replace(self, name=f"{self.name}_{end}", meaning=what, source="", label="")


EXACT = "95 % Clopper-Pearson interval"


def rate(name: str, meaning: str, interval: str = EXACT) -> Iterator[Column]:
    """The columns of a share of games and of the ends of its interval."""
    return Column(name, NUMBER, meaning, unit=SHARE).with_interval(interval)


ARM = Column("arm", TEXT, "The name of the arm, such as naive_vs_speedy.")
SEED = Column("seed", COUNT, "The training seed.")
EPISODES = Column("episodes", COUNT, "Games of the arm.", label="games")
