"""A persona's profile in the terminal. It is legible without colour, and as plain text in a file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from harness.reports.persona.drives import DRIVE_S
from harness.reports.persona.plotting import area, axis, curve, stretches, ticks
from harness.reports.persona.profile import (
    ATTENDS,
    DECIDES,
    FORMULA,
    WANTS,
    PersonaProfile,
    attends,
    body,
    decides,
    function_in_words,
    number,
    sees,
    wants,
)
from harness.reports.persona.worth import PayoffFunction

ROWS, SET_ROWS = 10, 2
_WIDEST = 100
_LABEL = 18  # columns before a drawing
_SPELLING = str.maketrans({
    "α": "alpha", "₀": "0", "₁": "1", "₂": "2", "Σ": "sum of", "·": "*", "×": "x", "²": "2", "…": "~",
    "\N{MINUS SIGN}": "-", "’": "'",
})  # fmt: skip


def show(profile: PersonaProfile, console: Console) -> None:
    """Print the profile in the width of the console."""
    persona = profile.persona
    plain = console.options.ascii_only
    columns = max(min(console.width - _LABEL - 2, _WIDEST), 20)

    def write(text: str, style: str = "") -> None:
        console.print(Text(_spelled(text, plain), style), highlight=False)

    write(persona.name, "bold")
    write(persona.description)
    for source in persona.sources:
        text = Text(_spelled(f"{source.statistic} [{source.citation}]", plain), "dim")
        console.print(Padding(text, (0, 0, 0, 2), expand=False), highlight=False)
    write("")
    write(WANTS, "bold")
    write(FORMULA)
    console.print(_terms(profile, plain))
    for sentence in wants(profile):
        write(sentence)
    for function in profile.functions:
        write("")
        write(f"{function.name}: a function of {function.quantity}", "bold")
        write(f"{function.meaning}{f', {function.unit}' if function.unit else ''}")
        for line in _function(function, columns, plain):
            console.print(line, highlight=False, no_wrap=True, overflow="crop")
        write(function_in_words(function))
    write("")
    write(ATTENDS, "bold")
    for sentence in (*attends(profile), *sees(profile), *body(profile)):
        write(sentence)
    if persona.human_factors.attention is not None:
        for line in _drives(profile, columns, plain):
            console.print(line, highlight=False, no_wrap=True, overflow="crop")
    write("")
    write(DECIDES, "bold")
    write(decides(profile))


def _terms(profile: PersonaProfile, plain: bool) -> Table:
    table = Table(show_edge=False, pad_edge=False, header_style="", show_lines=False)
    table.add_column("term", no_wrap=True)
    table.add_column(_spelled("α × weight", plain), justify="right", no_wrap=True)
    table.add_column("counted for")
    table.add_column("payoff")
    rows = []
    for each in profile.terms:
        counted = f"{each.meaning}, {each.limit}" if each.limit else each.meaning
        worth = f"{number(each.worth)} {each.moment}"
        rows.append((each.name, each.alpha, each.weight, counted, worth))
    for function in profile.functions:
        worth = f"{number(function.worst[0])} to {number(function.best[0])} per second"
        counted = f"a function of {function.quantity}, below"
        rows.append((function.name, function.alpha, function.weight, counted, worth))
    for name, alpha, weight, counted, worth in rows:
        table.add_row(*(Text(_spelled(text, plain)) for text in (name, f"{alpha:g} × {weight:g}", counted, worth)))
    return table


def _function(function: PayoffFunction, columns: int, plain: bool) -> Iterator[Text]:
    """The membership of each set, and below them the payoff over the quantity."""
    even = np.linspace(function.inputs[0], function.inputs[-1], len(function.inputs))
    for name, value, membership in function.sets:
        drawing = area(np.interp(even, function.inputs, membership), columns, SET_ROWS, plain)
        for label, line in zip(
            (*[""] * (SET_ROWS - 1), _short(_spelled(f"{name} ({number(value)})", plain))), drawing, strict=True
        ):
            yield Text.assemble(f"{label:>{_LABEL}} ", (line, "cyan"))
    low, high = min(float(function.worth.min()), 0.0), max(float(function.worth.max()), 0.0)
    if low == high:
        low, high = -1.0, 1.0
    labels = {0: number(high), ROWS - 1: _spelled(number(low), plain)}
    zero = round(high / (high - low) * (ROWS - 1))
    labels.setdefault(zero, "0")
    for row, line in enumerate(curve(function.inputs, function.worth, columns, ROWS, low, high, plain)):
        label = labels.get(row, "") + (" per second" if row == 0 else "")
        ground = "." if plain else "┈"
        yield Text.assemble(f"{label:>{_LABEL}} ", (line.replace(" ", ground) if row == zero else line, "bold"))
    first, last = float(function.inputs[0]), float(function.inputs[-1])
    places = [((each - first) / (last - first), f"{each:.6g}") for each in ticks(first, last)]
    yield Text(f"{function.quantity:>{_LABEL}} {axis(places, columns)}")


def _drives(profile: PersonaProfile, columns: int, plain: bool) -> Iterator[Text]:
    """A line for each drive, and the axis of time."""
    for k, drive in enumerate(profile.drives, 1):
        label = f"drive {k}" + (", no check" if drive.no_blind_spot_check else "")
        yield Text.assemble(f"{label:<{_LABEL}} ", (stretches(drive.lapses, DRIVE_S, columns, plain), "yellow"))
    places = [(time / DRIVE_S, f"{time:g} s") for time in ticks(0.0, DRIVE_S)]
    yield Text(f"{'':<{_LABEL}} {axis(places, columns)}")
    filled, empty = "#." if plain else "█·"
    yield Text(f"{'':<{_LABEL}} {filled} lapse of attention   {empty} attentive")


def _short(text: str) -> str:
    return text if len(text) <= _LABEL else text[: _LABEL - 2] + ".."


def _spelled(text: str, plain: bool) -> str:
    return text.translate(_SPELLING) if plain else text
