"""A persona's profile in the terminal. It is legible without colour, and as plain text in a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from harness.reports.persona.drives import DRIVE_S
from harness.reports.persona.profile import (
    ATTENDS,
    DECIDES,
    FORMULA,
    NO_GLANCE_MARK,
    WANTS,
    PersonaProfile,
    function_in_words,
    number,
)
from harness.reports.persona.worth import PayoffFunction

EXAMPLES = 9
"""Values of its quantity at which a function is printed."""
_SPELLING = str.maketrans({
    "α": "alpha", "₀": "0", "₁": "1", "₂": "2", "Σ": "sum of", "·": "*", "×": "x", "²": "2", "…": "~",
    "\N{MINUS SIGN}": "-", "’": "'",
})  # fmt: skip


def show(profile: PersonaProfile, console: Console) -> None:
    """Print the profile in the width of the console."""
    persona, plain = profile.persona, console.options.ascii_only

    def write(text: str, style: str = "", indent: int = 0) -> None:
        console.print(Padding(Text(_spelled(text, plain), style), (0, 0, 0, indent), expand=False), highlight=False)

    def write_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        table = Table(show_edge=False, pad_edge=False, header_style="")
        for heading in headings:
            table.add_column(Text(_spelled(heading, plain)), overflow="fold")
        for row in rows:
            table.add_row(*(Text(_spelled(text, plain)) for text in row))
        console.print(table)

    write(persona.name, "bold")
    write(persona.description)
    for source in persona.sources:
        write(f"{source.statistic} [{source.citation}]", "dim", indent=2)
    write(f"\n{WANTS}", "bold")
    write(FORMULA)
    rows = ((name, weight, counted, worth) for name, _, weight, counted, worth in profile.payoffs)
    write_table(("term", "α × weight", "counted for", "payoff"), rows)
    for sentence in profile.wants:
        write(sentence)
    for function in profile.functions:
        write(f"\n{function.name}: a function of {function.quantity}", "bold")
        write(f"{function.meaning}{f', {function.unit}' if function.unit else ''}")
        sets = [f"{name} ({number(value)})" for name, value, _ in function.sets]
        write_table((function.quantity, *sets, "payoff per second"), _examples(function))
        write(function_in_words(function))
    write(f"\n{ATTENDS}", "bold")
    for sentence in profile.attends:
        write(sentence)
    if persona.human_factors.attention is not None:
        write_table((f"drive of {DRIVE_S:g} s", "lapses of attention (s)"), _drives(profile))
    write(f"\n{DECIDES}", "bold")
    write(profile.decides)


def _examples(function: PayoffFunction) -> Iterable[Sequence[str]]:
    for value in np.linspace(function.inputs[0], function.inputs[-1], EXAMPLES):
        memberships = [np.interp(value, function.inputs, membership) for _, _, membership in function.sets]
        payoff = float(np.interp(value, function.inputs, function.worth))
        yield f"{value:.3g}", *(f"{each:.2g}" for each in memberships), number(payoff)


def _drives(profile: PersonaProfile) -> Iterable[Sequence[str]]:
    for k, drive in enumerate(profile.drives, 1):
        check = "" if drive.shoulder_glance else NO_GLANCE_MARK
        yield f"{k}{check}", ", ".join(f"{begin:.3g} to {end:.3g}" for begin, end in drive.lapses) or "none"


def _spelled(text: str, plain: bool) -> str:
    return text.translate(_SPELLING) if plain else text
