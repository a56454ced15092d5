"""Tables on the terminal whose cells are text as it is: no name of a run, an ego or a place is read as markup."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

from rich.table import Table
from rich.text import Text

from harness.errors import plain
from harness.reports.numbers import NO_SPACE


def text_table(
    headings: Iterable[str],
    *,
    right: Container[str] = (),
    whole: Container[str] = (),
    title: str = "",
    caption: str = "",
    **look: Any,
) -> Table:
    """A table of these columns, without rows. `right` are those of numbers, `whole` those whose cells are never broken;
    cells of the others fold. `look` is as of rich's `Table`."""
    around = {name: _text(words) for name, words in (("title", title), ("caption", caption)) if words}
    table = Table(**{"box": None, "pad_edge": False, "title_justify": "left", **around, **look})
    for heading in headings:
        is_whole, side = heading in whole, "right" if heading in right else "left"
        overflow = "ellipsis" if is_whole else "fold"
        table.add_column(_text(heading), justify=side, no_wrap=is_whole, overflow=overflow)  # type: ignore[arg-type]
    return table


def add_text_row(table: Table, *cells: str | Iterable[str], style: str | None = None) -> None:
    """Add a row; a cell of several texts has a line for each."""
    lines = ([cell] if isinstance(cell, str) else cell for cell in cells)
    table.add_row(*(Text("\n").join(map(_text, each)) for each in lines), style=style)


def _text(words: str) -> Text:
    """Plain text, with the spaces at which no line is broken."""
    return Text(NO_SPACE.join(map(plain, words.split(NO_SPACE))))
