"""The results as a table: on the terminal, and in Markdown for the documentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from benchmarks.figures import FIGURES, KEYS, Figure

_WORDS = {True: "yes", False: "no", None: ""}
_STYLES = {True: "green", False: "red", None: ""}


def _reached(figure: Figure, value: float | None) -> str:
    return "" if value is None else _WORDS[figure.reached(value)]


def terminal_table(results: Mapping[str, Any], keys: Sequence[str] = KEYS) -> Table:
    """A table of these figures for the terminal."""
    table = Table(title="benchmarks" + (" (fast: figures are not meaningful)" if results["details"]["fast"] else ""))
    for column, side in (("figure", "left"), ("what", "left"), ("value", "right"), ("target", "right")):
        table.add_column(column, justify="right" if side == "right" else "left", no_wrap=column != "what")
    table.add_column("reached")
    for figure in FIGURES:
        if figure.key in keys:
            value = results.get(figure.key)
            style = _STYLES[figure.reached(value)] if value is not None else "dim"
            row = (
                figure.key,
                figure.meaning,
                figure.format_value(value),
                figure.format_target(),
                _reached(figure, value),
            )
            table.add_row(*row, style=style)
    return table


def markdown_table(results: Mapping[str, Any]) -> str:
    """A table of all figures for the documentation, with the machine and the versions below it."""
    lines = ["| figure | what | value | target | reached |", "| --- | --- | ---: | ---: | --- |"]
    for figure in FIGURES:
        value = results.get(figure.key)
        cells = (f"`{figure.key}`", figure.meaning, figure.format_value(value), figure.format_target())
        lines.append(f"| {' | '.join(cells)} | {_reached(figure, value)} |")
    lines += ["", described_machine(results)]
    return "\n".join(lines)


def described_machine(results: Mapping[str, Any]) -> str:
    """A sentence with the machine and the versions that the figures were measured on."""
    machine, versions = results["machine"], results["versions"]
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    ram = f", {machine['ram_gb']:g} GB" if machine["ram_gb"] else ""
    return f"Measured on {machine['cpu']}, {machine['cores']} cores{ram}, {machine['os']}; {packages}."
