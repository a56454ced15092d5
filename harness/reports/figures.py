"""The page's figures as inline SVG: text stays text, and every colour is one of the page's own.

matplotlib draws with stand-in colours, which become `currentColor` and the custom properties of report.css: a figure
is legible on a dark and on a light page. matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import TYPE_CHECKING

from markupsafe import Markup

from harness.reports.compact_svg import compact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, GRID = "#010101", "#010102"
SERIES = {"alone": "#010111", "sumo": "#010112", "persona": "#010113", "retrained": "#010114"}
ROAD = {"asphalt": "#010121", "rail": "#010122", "ego": "#010123", "non-ego": "#010124", "contact": "#010125"}
TONES = {
    "ink": "#010130",
    "mended": "#010131",
    "severity-small": "#010132",
    "severity-medium": "#010133",
    "severity-severe": "#010134",
    "open": "#010135",
}
_PAGE_COLOURS = {INK: "currentColor", GRID: "var(--grid)"} | {
    stand_in: f"var(--{name})" for name, stand_in in (SERIES | ROAD | TONES).items()
}
_STYLE = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "text.parse_math": False,
    "axes.formatter.useoffset": False,
    "figure.constrained_layout.use": True,
}
GAME = "#game="
"""The beginning of the address of a recorded game of the page."""


_DRAWING = RLock()


@contextmanager
def figure_of(width_in: float, height_in: float) -> Iterator[Figure]:
    """An empty figure in the page's style, which is active within the with block.

    One thread draws at a time: the style is that of the process, and a server of pages has several threads.
    """
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with _DRAWING, matplotlib.rc_context():
        matplotlib.rcdefaults()  # the user's matplotlibrc must not change the report
        matplotlib.rcParams.update(_STYLE | {"svg.hashsalt": "harness"})
        figure = Figure(figsize=(width_in, height_in))
        FigureCanvasSVG(figure)
        yield figure


_DOT = re.compile(r'(<a [^>]*>)\s*<g clip-path="[^"]*">\s*(<use [^>]*>)\s*</g>\s*</a>\s*')
"""The link of a dot, with its blanks and the clipping that changes nothing within the axes."""
_STYLED = re.compile(r'<use xlink:href="#(C[^"]+)"[^>]* style="([^"]*)"')
_PLACES = re.compile(r' (?:x|y|transform)="[^"]*"')
_DIGITS = re.compile(r"(\.\d\d)\d+")


def svg(figure: Figure, name: str, alternative: str) -> Markup:
    """The figure as an element of the page. `name` is its class and the prefix of its ids, and unique on the page."""
    written = io.StringIO()
    figure.savefig(written, format="svg", transparent=True, metadata={"Date": None})
    drawn = written.getvalue()
    size = re.search(r'viewBox="[^"]*"', drawn)
    assert size is not None  # matplotlib always writes one
    drawn = re.sub(r"<(metadata|style)\b.*?</\1>", "", drawn[drawn.index(">", size.end()) + 1 :], flags=re.DOTALL)
    drawn = _DOT.sub(r"\1\2</a>", drawn.replace(f'xlink:href="{GAME}', f'href="{GAME}'))
    for marker, style in dict(_STYLED.findall(drawn)).items():  # all dots of a collection have the style of one
        drawn = re.sub(f'(<use xlink:href="#{marker}"[^>]*?) style="[^"]*"', r"\1", drawn)
        drawn = drawn.replace(f'<path id="{marker}"', f'<path id="{marker}" style="{style}"')
    drawn = _PLACES.sub(lambda attribute: _DIGITS.sub(r"\1", attribute[0]), drawn)
    drawn = re.sub(r"font(?:-size)?: ([\d.]+px)(?:;? [^;\"]*'DejaVu Sans'[^;\"]*)", r"font-size: \1", drawn)
    drawn = compact(drawn.replace("xlink:href=", "href="), name)
    for stand_in, colour in _PAGE_COLOURS.items():
        drawn = drawn.replace(stand_in, colour)
    role = "group" if GAME in drawn else "img"  # what is inside an image can't be a link
    head = Markup('<svg class="{}" {} role="{}" aria-label="{}">').format(name, Markup(size[0]), role, alternative)
    return head + Markup(drawn)
