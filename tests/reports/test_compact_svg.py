"""Figures in fewer characters: the same shapes at the same places, to the eye of a browser."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.reports import figures
from harness.reports.compact_svg import compact, compact_path
from harness.reports.figures import INK, SERIES, figure_of, svg

NUMBERS = re.compile(r"-?(?:\d+\.?\d*|\.\d+)")
Points = list[tuple[float, float]]


@pytest.mark.parametrize(
    ("path", "short"),
    [
        ("M 44.92 115.13 L 45.06 104.87 L 45.20 105.25 ", "m44.92 115.13.14-10.26.14.38"),
        ("M 1.5 2 L 1.5 2 ", "m1.5 2h0"),  # a dot
        ("M 10 20 L 30 20 L 30 25 L 31 26 z", "m10 20h20v5l1 1z"),
        ("M 0 0 L 1 1 z\nM 5 5 L 6 6 L 7 7", "m0 0 1 1zm5 5 1 1 1 1"),  # after the end of a shape from its beginning
        ("M 0 1.2 C 0.31 1.2 0.62 1.07 0.84 0.84 Q 1 2 3 4", "m0 1.2c.31 0 .62-.13.84-.36q.16 1.16 2.16 3.16"),
        ("M 0 0 L 0.004 0.004 L 0.008 0.008 L 0.012 0.012", "m0 0h0l.01.01h0"),  # errors do not add up
        ("M1 2h0", "M1 2h0"),  # not as matplotlib writes paths
        ("", ""),
    ],
)
def test_path__is_written_with_relative_coordinates(path: str, short: str) -> None:
    assert compact_path(path) == short


coordinates = st.floats(-2000, 2000, allow_nan=False)
points = st.tuples(coordinates, coordinates)


@given(shapes=st.lists(st.tuples(st.lists(points, min_size=2, max_size=40), st.booleans()), min_size=1, max_size=3))
def test_path__leads_to_the_same_points(shapes: list[tuple[Points, bool]]) -> None:
    """Also where numbers follow one another without a blank; a path of more than 20 points is as fine as 0.1."""
    path = " ".join(
        "M " + " L ".join(f"{x:f} {y:f}" for x, y in corners) + (" z" if is_closed else "")
        for corners, is_closed in shapes
    )
    commands = sum(len(corners) + is_closed for corners, is_closed in shapes)
    tolerance = 0.0501 if commands > 20 else 0.00501
    found = points_of(compact_path(path))
    assert len(found) == len(shapes)
    for read, (corners, _) in zip(found, shapes, strict=True):
        assert np.abs(np.array(read) - np.array(corners)).max() <= tolerance


def points_of(path: str) -> list[Points]:
    """The points of a path of relative moves and lines, shape by shape, as the grammar of SVG reads them."""
    shapes: list[Points] = []
    at = (0.0, 0.0)
    for command, text in re.findall(r"([a-z])([^a-z]*)", path):
        numbers = [float(each) for each in NUMBERS.findall(text)]
        match command:
            case "z":
                at = shapes[-1][0]
                continue
            case "m":
                shapes.append([])
                steps = list(zip(numbers[::2], numbers[1::2], strict=True))
            case "l":
                steps = list(zip(numbers[::2], numbers[1::2], strict=True))
            case "h":
                steps = [(number, 0.0) for number in numbers]
            case "v":
                steps = [(0.0, number) for number in numbers]
            case _:
                raise AssertionError(command)
        for x, y in steps:
            at = at[0] + x, at[1] + y
            shapes[-1].append(at)
    return shapes


def test_drawing__has_what_draws_and_nothing_else() -> None:
    drawn = """
 <defs><clipPath id="c1"><rect x="0" y="0"/></clipPath></defs>
 <!-- a comment -->
 <g id="figure_1">
  <g id="line"><path id="one" d="M 0 0 L 1 0 " clip-path="url(#c1)" style="fill: none; stroke: red"/></g>
  <g id="line2"><path d="M 0 1 L 1 1 " clip-path="url(#c1)" style="fill: none; stroke: red"/></g>
  <g clip-path="url(#c1)"><a href="#game=x,1,2"><circle r="1"/></a></g>
  <g clip-path="url(#c1)"><circle r="2"/></g>
  <text style="fill: blue" transform="rotate(-0 1 2)" x="1">two  words </text>
 </g>
</svg>"""
    assert compact(drawn, "own") == (
        "<style>.own .a{fill:none;stroke:red;clip-path:url(#own-0)}</style>"
        '<defs><clipPath id="own-0"><rect x="0" y="0"/></clipPath></defs>'
        '<path class="a" d="m0 0h1"/><path class="a" d="m0 1h1"/>'
        '<g clip-path="url(#own-0)"><a href="#game=x,1,2"><circle r="1"/></a><circle r="2"/></g>'
        '<text style="fill:blue" x="1">two  words </text></svg>'
    )


@pytest.mark.slow
def test_figure__looks_as_matplotlib_drew_it_in_fewer_characters(browser: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    short = figure()
    monkeypatch.setattr(figures, "compact", lambda drawing, name: drawing)
    long = figure()
    assert len(short) < 0.6 * len(long)
    one, other = (picture(browser, each) for each in (short, long))
    assert one.shape == other.shape
    assert (one < 128).sum() > 1000  # something is drawn
    assert (np.abs(one - other) > 96).mean() < 1e-4  # along slanting lines, shades differ a little


def figure() -> str:
    """Curves, dots with and without links, bars, words along an axis and dashes."""
    random = np.random.default_rng(1)
    with figure_of(5.6, 4.0) as drawing:
        above, below = drawing.subplots(2)
        above.plot(np.arange(300), random.normal(size=300).cumsum(), color=SERIES["persona"])
        above.plot([0, 300], [0, 3], color=INK, linestyle="--")
        below.scatter(random.random(200), random.random(200), s=14, color=SERIES["sumo"], linewidths=0)
        below.scatter(
            *random.random((2, 100)), marker="X", s=46, color=INK, urls=[f"#game=a,1,{n}" for n in range(100)]
        )
        below.bar([0.1, 0.2], [0.5, 0.8], width=0.05, color=SERIES["alone"])
        below.set_ylabel("share of the games (%)")
        return svg(drawing, "own", "a figure")


def picture(browser: Any, element: str) -> np.ndarray:
    from PIL import Image

    page = browser.new_page(viewport={"width": 900, "height": 700})
    page.set_content(f"<body style='margin: 0; color: black'><figure style='margin: 0'>{element}</figure></body>")
    shown = Image.open(io.BytesIO(page.locator("svg").screenshot()))
    page.close()
    return np.asarray(shown.convert("L")).astype(int)
