"""A net, or a scene on it, as one HTML file: drawn to scale, opens offline, loads nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.game.arrays import FloatArray
from harness.reports.page_template import page_of, write_page

_MARGIN_M = 15.0


@dataclass(frozen=True, kw_only=True)
class DrawnShape:
    """A line or an outline [n, 2] (m) with the text that appears when the pointer is over it."""

    points: FloatArray
    text: str
    kind: str  # its class in the style sheet
    label: str = ""  # drawn beside its middle when the drawing is enlarged

    @property
    def path(self) -> str:
        """The points for SVG. Its y axis points down."""
        return " ".join(f"{x:.2f},{-y:.2f}" for x, y in self.points)

    @property
    def place(self) -> tuple[float, float]:
        x, y = self.points[len(self.points) // 2] if len(self.points) != 2 else self.points.mean(0)
        return round(float(x), 2), round(-float(y), 2)


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """What the page shows: shapes in the order in which they are drawn, and marks, which are points (m)."""

    title: str
    summary: str
    shapes: Sequence[DrawnShape]
    marks: Sequence[DrawnShape] = ()
    opens_on: Sequence[DrawnShape] = ()
    """Those of them that fill the page at first; empty: all."""

    @property
    def view(self) -> str:
        points = np.concatenate([shape.points for shape in self.opens_on or (*self.shapes, *self.marks)])
        (left, low), (right, high) = points.min(0) - _MARGIN_M, points.max(0) + _MARGIN_M
        return f"{left:.2f} {-high:.2f} {right - left:.2f} {high - low:.2f}"


def write_net_page(drawing: Drawing, file: Path) -> None:
    """Write the page. Raises UsageError when the file's name or folder is wrong."""
    write_page(file, page_of("net", drawing=drawing))
