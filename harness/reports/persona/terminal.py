"""A persona's portrait in the terminal; it can be read without colour, and where it is not a terminal at all."""

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
    FORMULA,
    PersonaProfile,
    attends,
    body,
    decides,
    function_in_words,
    number,
    sees,
    wants,
)
from harness.reports.persona.worth import Drawn

ROWS, SET_ROWS = 10, 2
_WIDEST = 100
_LABEL = 18  # columns before a drawing
_SPELLING = str.maketrans({
    "α": "alpha", "₀": "0", "₁": "1", "₂": "2", "Σ": "sum of", "·": "*", "×": "x", "²": "2", "…": "~",
    "\N{MINUS SIGN}": "-", "’": "'",
})  # fmt: skip


def show(portrait: PersonaProfile, console: Console) -> None:
    """Draw it as wide as the console is."""
    persona = portrait.persona
    plain = console.options.ascii_only
    columns = max(min(console.width - _LABEL - 2, _WIDEST), 20)

    def say(text: str, style: str = "") -> None:
        console.print(Text(_spelt(text, plain), style), highlight=False)

    say(persona.name, "bold")
    say(persona.description)
    for source in persona.sources:
        text = Text(_spelt(f"{source.statistic} [{source.citation}]", plain), "dim")
        console.print(Padding(text, (0, 0, 0, 2), expand=False), highlight=False)
    say("")
    say("What this person wants", "bold")
    say(FORMULA)
    console.print(_terms(portrait, plain))
    for sentence in wants(portrait):
        say(sentence)
    for function in portrait.functions:
        say("")
        say(f"{function.name}: a function of {function.quantity}", "bold")
        say(f"{function.meaning}{f', {function.unit}' if function.unit else ''}")
        for line in _function(function, columns, plain):
            console.print(line, highlight=False, no_wrap=True, overflow="crop")
        say(function_in_words(function))
    say("")
    say("How this person attends", "bold")
    for sentence in (*attends(portrait), *sees(portrait), *body(portrait)):
        say(sentence)
    if persona.human_factors.attention is not None:
        for line in _drives(portrait, columns, plain):
            console.print(line, highlight=False, no_wrap=True, overflow="crop")
    say("")
    say("How this person decides", "bold")
    say(decides(portrait))


def _terms(portrait: PersonaProfile, plain: bool) -> Table:
    table = Table(show_edge=False, pad_edge=False, header_style="", show_lines=False)
    table.add_column("term", no_wrap=True)
    table.add_column(_spelt("α × weight", plain), justify="right", no_wrap=True)
    table.add_column("counted for")
    table.add_column("worth")
    rows = []
    for each in portrait.terms:
        counted = f"{each.meaning}, {each.limit}" if each.limit else each.meaning
        worth = f"{number(each.worth)} {each.moment}"
        rows.append((each.name, each.alpha, each.weight, counted, worth))
    for function in portrait.functions:
        worth = f"{number(function.worst[0])} to {number(function.best[0])} per second"
        counted = f"a function of {function.quantity}, below"
        rows.append((function.name, function.alpha, function.weight, counted, worth))
    for name, alpha, weight, counted, worth in rows:
        table.add_row(*(Text(_spelt(text, plain)) for text in (name, f"{alpha:g} × {weight:g}", counted, worth)))
    return table


def _function(function: Drawn, columns: int, plain: bool) -> Iterator[Text]:
    """Each set's membership, and below them what the quantity is worth."""
    even = np.linspace(function.inputs[0], function.inputs[-1], len(function.inputs))
    for name, value, membership in function.sets:
        drawing = area(np.interp(even, function.inputs, membership), columns, SET_ROWS, plain)
        for label, line in zip(
            (*[""] * (SET_ROWS - 1), _short(_spelt(f"{name} ({number(value)})", plain))), drawing, strict=True
        ):
            yield Text.assemble(f"{label:>{_LABEL}} ", (line, "cyan"))
    low, high = min(float(function.worth.min()), 0.0), max(float(function.worth.max()), 0.0)
    if low == high:
        low, high = -1.0, 1.0
    labels = {0: number(high), ROWS - 1: _spelt(number(low), plain)}
    zero = round(high / (high - low) * (ROWS - 1))
    labels.setdefault(zero, "0")
    for row, line in enumerate(curve(function.inputs, function.worth, columns, ROWS, low, high, plain)):
        label = labels.get(row, "") + (" per second" if row == 0 else "")
        ground = "." if plain else "┈"
        yield Text.assemble(f"{label:>{_LABEL}} ", (line.replace(" ", ground) if row == zero else line, "bold"))
    first, last = float(function.inputs[0]), float(function.inputs[-1])
    places = [((each - first) / (last - first), f"{each:.6g}") for each in ticks(first, last)]
    yield Text(f"{function.quantity:>{_LABEL}} {axis(places, columns)}")


def _drives(portrait: PersonaProfile, columns: int, plain: bool) -> Iterator[Text]:
    """A line for each drive, and the axis of time."""
    for k, drive in enumerate(portrait.drives, 1):
        label = f"drive {k}" + (", overlooks" if drive.overlooks else "")
        yield Text.assemble(f"{label:<{_LABEL}} ", (stretches(drive.lapses, DRIVE_S, columns, plain), "yellow"))
    places = [(time / DRIVE_S, f"{time:g} s") for time in ticks(0.0, DRIVE_S)]
    yield Text(f"{'':<{_LABEL}} {axis(places, columns)}")
    filled, empty = "#." if plain else "█·"
    yield Text(f"{'':<{_LABEL}} {filled} attention is elsewhere   {empty} on the road")


def _short(text: str) -> str:
    return text if len(text) <= _LABEL else text[: _LABEL - 2] + ".."


def _spelt(text: str, plain: bool) -> str:
    return text.translate(_SPELLING) if plain else text
