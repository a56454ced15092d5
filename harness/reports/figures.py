"""The page's figures as inline SVG: text stays text, and every colour is one of the page's own.

matplotlib draws with stand-in colours, which become `currentColor` and the custom properties of report.css: a figure
is legible on a dark and on a light page. matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup

from harness.evaluation.competence import DID_NOT_LEARN
from harness.reports.numbers import short, steps_text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOT_PLAYED = "not played"
INK, GRID = "#010101", "#010102"
SERIES = {"alone": "#010111", "sumo": "#010112", "persona": "#010113", "retrained": "#010114"}
_PAGE_COLOURS = {INK: "currentColor", GRID: "var(--grid)"} | {
    stand_in: f"var(--{name})" for name, stand_in in SERIES.items()
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
_LINES = ("-", "--", ":", "-.")


@dataclass(frozen=True, kw_only=True)
class Point:
    """One training seed's value of an arm, with its 95 % interval (NaN: none)."""

    seed: int
    value: float
    low: float
    high: float
    middle_half: tuple[float, float] | None = None
    """Quartiles over the games, where a value is a mean over games."""


@dataclass(frozen=True, kw_only=True)
class ArmBar:
    """One arm in a figure. `series` is a key of SERIES."""

    label: str
    series: str
    points: Sequence[Point]
    link: str = ""
    """The address that its bar and its points lead to; empty: none."""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One training: values [N] at `steps` [N], and the step it stopped at, if it has."""

    seed: int
    steps: Sequence[float]
    payoffs: Sequence[float]
    failure_rates: Sequence[float]
    stopped_at: float | None
    stopped: str
    """The reason, as the manifest has it."""


def rate_figure(columns: Sequence[ArmBar], name: str, alternative: str) -> Markup:
    """A share of games per arm: a bar for the mean over seeds, and each seed's value with its interval."""
    with figure_of(4.8, 3.3) as figure:
        axes = _arms(figure, columns)
        for place, column in enumerate(columns):
            values = [point.value for point in column.points if math.isfinite(point.value)]
            if values:
                mean = sum(values) / len(values)
                bar = axes.bar(place, mean, 0.62, color=SERIES[column.series], alpha=0.35, linewidth=0)
                _link(bar, column.link)
        tops = [max(point.value, point.high) for column in columns for point in column.points]
        axes.set_ylim(0, max([0.05, *(top for top in tops if math.isfinite(top))]) * 1.14)
        axes.set_ylabel("failure rate (%)")
        axes.yaxis.set_major_formatter(lambda share, _: f"{share * 100:.3g}")
        _points(axes, columns, lambda share: f"{share * 100:.1f}".removesuffix(".0") + " %")
        return svg(figure, name, alternative)


def speed_figure(columns: Sequence[ArmBar], name: str, alternative: str) -> Markup:
    """Average speed per arm: a pale bar from quartile to quartile of the games, the mean and its interval."""
    with figure_of(4.8, 3.3) as figure:
        axes = _arms(figure, columns)
        axes.use_sticky_edges = False  # the pale bars do not start at the axis
        for place, column in enumerate(columns):
            for offset, point in _beside(column.points):
                if point.middle_half:
                    low, high = point.middle_half
                    bar = axes.bar(
                        place + offset, high - low, 0.62 / len(column.points), bottom=low,
                        color=SERIES[column.series], alpha=0.3, linewidth=0,
                    )  # fmt: skip
                    _link(bar, column.link)
        axes.set_ylabel("average speed of the ego (m/s)")
        _points(axes, columns, lambda speed: f"{speed:.1f}")
        axes.margins(y=0.14)
        return svg(figure, name, alternative)


def learning_figure(curves: Sequence[Curve], series: str, name: str, alternative: str) -> Markup:
    """Mean payoff and failure rate of the learner over its steps, a line per seed, and where each stopped."""
    with figure_of(3.7, 3.9) as figure:
        payoff, failure = figure.subplots(2, 1, sharex=True)
        for place, curve in enumerate(curves):
            line = {
                "color": SERIES[series],
                "linestyle": _LINES[place % len(_LINES)],
                "marker": "o" if len(curve.steps) <= 30 else "",
                "markersize": 3,
            }
            payoff.plot(curve.steps, curve.payoffs, label=f"seed {curve.seed}", **line)
            failure.plot(curve.steps, curve.failure_rates, **line)
            if curve.stopped_at is not None:
                for axes in (payoff, failure):
                    axes.axvline(curve.stopped_at, color=INK, linewidth=1, linestyle=line["linestyle"])
        if len(curves) > 1:
            payoff.legend(frameon=False, fontsize=8)
        elif curves[0].stopped_at is not None:
            payoff.annotate(
                _end(curves[0]), (curves[0].stopped_at, 1), (0, 3),
                xycoords=("data", "axes fraction"), textcoords="offset points", ha="right", fontsize=9,
            )  # fmt: skip
        payoff.set_ylabel("mean payoff")
        payoff.yaxis.set_major_formatter(lambda value, _: short(value))
        failure.set_ylabel("failure rate (%)")
        failure.yaxis.set_major_formatter(lambda share, _: f"{share * 100:.3g}")
        rates = [rate for curve in curves for rate in curve.failure_rates if math.isfinite(rate)]
        failure.set_ylim(0, max([0.05, *rates]) * 1.08)
        failure.set_xlim(left=0)
        failure.xaxis.set_major_formatter(lambda steps, _: steps_text(steps))
        failure.locator_params(axis="x", nbins=5)
        failure.set_xlabel("training steps")
        return svg(figure, name, alternative)


def _end(curve: Curve) -> str:
    """Where a curve ends. No text that a run folder brings is drawn."""
    reasons = {"converged": "stopped early", "budget": "budget used", DID_NOT_LEARN: DID_NOT_LEARN}
    return f"{reasons.get(curve.stopped, 'stopped')}: {steps_text(curve.stopped_at or 0.0)}"


@contextmanager
def figure_of(width_in: float, height_in: float) -> Iterator[Figure]:
    """An empty figure in the page's style, which is active within the with block."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # the user's matplotlibrc must not change the report
        matplotlib.rcParams.update(_STYLE | {"svg.hashsalt": "harness"})
        figure = Figure(figsize=(width_in, height_in))
        FigureCanvasSVG(figure)
        yield figure


def _arms(figure: Figure, columns: Sequence[ArmBar]) -> Axes:
    axes = figure.subplots()
    axes.set_xticks(range(len(columns)), [""] * len(columns))
    for place, column in enumerate(columns):  # only a text of one line has the same middle in any font
        for line, words in enumerate(column.label.split("\n")):
            below = (0, -14 - 12 * line)
            axes.annotate(
                words, (place, 0), below, xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center",
            )  # fmt: skip
    axes.set_xlim(-0.55, len(columns) - 0.45)
    axes.tick_params(axis="x", length=0)
    return axes


def _beside(points: Sequence[Point]) -> Iterator[tuple[float, Point]]:
    """Each seed's offset from the middle of its arm."""
    for place, point in enumerate(points):
        yield 0.62 * ((place + 0.5) / len(points) - 0.5), point


def _points(axes: Axes, columns: Sequence[ArmBar], text: Callable[[float], str]) -> None:
    for place, column in enumerate(columns):
        for offset, point in _beside(column.points):
            if not math.isfinite(point.value):
                continue
            x, colour = place + offset, SERIES[column.series]
            top = point.value
            if math.isfinite(point.low) and math.isfinite(point.high):
                reach = [[point.value - point.low], [point.high - point.value]]
                axes.errorbar(x, point.value, yerr=reach, color=colour, linewidth=1.8, capsize=4, capthick=1.8)
                top = point.high
            _link(axes.plot(x, point.value, "o", color=colour, markersize=6, clip_on=False, zorder=4), column.link)
            if len(column.points) <= 2:
                axes.annotate(text(point.value), (x, top), (0, 4), textcoords="offset points", ha="center", fontsize=9)
        if not any(math.isfinite(point.value) for point in column.points):
            axes.annotate(NOT_PLAYED, (place, 0), (0, 6), xycoords=("data", "axes fraction"),
                          textcoords="offset points", ha="center", fontsize=9)  # fmt: skip


def _link(artists: Iterable[Artist], address: str) -> None:
    for artist in artists:
        artist.set_url(address or None)


_DOT = re.compile(r'(<a [^>]*>)\s*<g clip-path="[^"]*">\s*(<use [^>]*>)\s*</g>\s*</a>\s*')
"""The link of a dot, with its blanks and the clipping that changes nothing within the axes."""
_STYLED = re.compile(r'<use xlink:href="#(C[^"]+)"[^>]* style="([^"]*)"')
_PLACES = re.compile(r' (?:d|x|y|transform)="[^"]*"')
_DIGITS = re.compile(r"(\.\d\d)\d+")
_POINT = re.compile(r"M (\S+ \S+) L \1(?=\s)")
"""A line of no length, which is drawn as a dot."""


def svg(figure: Figure, name: str, alternative: str) -> Markup:
    """The figure as an element of the page. `name` is the prefix of its ids, which are unique on the page."""
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
    drawn = _PLACES.sub(lambda attribute: _DIGITS.sub(r"\1", attribute[0]).replace(" \n", " "), drawn)
    drawn = _POINT.sub(r"M\1h0", drawn)
    drawn = drawn.replace('xlink:href="#', f'href="#{name}-').replace("url(#", f"url(#{name}-")
    drawn = drawn.replace(' id="', f' id="{name}-')
    drawn = re.sub(r"font(?:-size)?: ([\d.]+px)(?:;? [^;\"]*'DejaVu Sans'[^;\"]*)", r"font-size: \1", drawn)
    for stand_in, colour in _PAGE_COLOURS.items():
        drawn = drawn.replace(stand_in, colour)
    role = "group" if GAME in drawn else "img"  # what is inside an image can't be a link
    return Markup('<svg {} role="{}" aria-label="{}">').format(Markup(size[0]), role, alternative) + Markup(drawn)
