"""Curves, bars and stretches of time in characters: Braille and blocks, or ASCII on a plain terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from harness.game.arrays import BoolArray, FloatArray

BLOCKS, ASCII_BLOCKS = " ▁▂▃▄▅▆▇█", " .:-=+*##"
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # of a Braille character, [row, column]


def curve(x: FloatArray, y: FloatArray, columns: int, rows: int, low: float, high: float, plain: bool) -> list[str]:
    """A line through (x, y) [N], x rising, over the whole width; `low` is the bottom and `high` the top."""
    down, across = (1, 1) if plain else _DOTS.shape
    dots = np.zeros((rows * down, columns * across), dtype=bool)
    at = np.interp(np.linspace(x[0], x[-1], dots.shape[1]), x, y)
    heights = np.rint((high - at) / (high - low) * (len(dots) - 1)).astype(int)
    for column, (before, here) in enumerate(zip((heights[0], *heights), heights, strict=False)):
        first, last = sorted((before + np.sign(here - before), here))  # joined to the previous column
        dots[first : last + 1, column] = True
    if plain:
        return ["".join("*" if dot else " " for dot in row) for row in dots]
    cells = dots.reshape(rows, down, columns, across) * _DOTS[None, :, None, :]
    return ["".join(chr(0x2800 + code) if code else " " for code in row) for row in cells.sum(axis=(1, 3))]


def area(values: FloatArray, columns: int, rows: int, plain: bool) -> list[str]:
    """Values in 0..1 [N] as filled columns."""
    blocks = ASCII_BLOCKS if plain else BLOCKS
    at = np.interp(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, len(values)), values)
    eighths = np.ceil(at * rows * 8 - 1e-9).astype(int)
    return ["".join(blocks[min(max(k - 8 * row, 0), 8)] for k in eighths) for row in reversed(range(rows))]


def stretches(spans: Iterable[tuple[float, float]], length: float, columns: int, plain: bool) -> str:
    """Stretches (begin, end) of a length as blocks; a column is filled where half of it is in one."""
    inside: BoolArray = np.zeros(columns, dtype=bool)
    middles = (np.arange(columns) + 0.5) * length / columns
    for begin, end in spans:
        inside |= (middles >= begin) & (middles < end)
    filled, empty = "#." if plain else "█·"
    return "".join(filled if each else empty for each in inside)


def ticks(low: float, high: float) -> list[float]:
    """Round numbers within low..high, four to nine of them."""
    size = 10.0 ** math.floor(math.log10((high - low) / 4.0))
    step = next(size * k for k in (5.0, 2.0, 1.0) if (high - low) / (size * k) >= 4.0)
    return [float(each) for each in np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1) * step]


def axis(labels: Sequence[tuple[float, str]], columns: int) -> str:
    """Labels at places in 0..1 of the width, as many as fit, the outermost first."""
    line = [" "] * columns
    for place, label in (labels[0], labels[-1], *labels[1:-1]):
        start = min(max(round(place * (columns - 1)) - len(label) // 2, 0), columns - len(label))
        around = line[max(start - 1, 0) : start + len(label) + 1]
        if start >= 0 and not "".join(around).strip():
            line[start : start + len(label)] = label
    return "".join(line)
