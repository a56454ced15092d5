"""A small drawing of a net for the terminal: its lanes as dots, and numbers where conflicts are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from harness.game.arrays import FloatArray

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a character of Braille: rows of two dots
_BLANK = 0x2800
_MARGIN = 0.03


def sketch(
    lines: Sequence[FloatArray],
    places: Sequence[tuple[int, FloatArray]],
    *,
    columns: int,
    rows: int,
    braille: bool = True,
) -> list[str]:
    """Lines [n, 2] drawn in rows of characters, with numbers at places [2] where there is room for them.

    Without `braille`, the drawing is of plain characters.
    """
    points = np.concatenate([*lines, *(np.atleast_2d(place) for _, place in places)])
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1.0)
    across, down = (2, 4) if braille else (1, 1)
    aspect = 1.0 if braille else 2.0  # a character is about twice as high as it is wide
    scale = min(columns * across / size[0], rows * down * aspect / size[1]) * (1.0 - _MARGIN)
    height = max(int(np.ceil(size[1] * scale / aspect / down)) + 1, 1)
    grid = np.zeros((height * down, (columns + 1) * across), dtype=bool)
    for line in lines:
        x, y = _cells(_densified(line, 0.5 / scale), low, high, scale, aspect)
        grid[np.clip(y, 0, len(grid) - 1), np.clip(x, 0, grid.shape[1] - 1)] = True
    rows_of = [_row(grid[down * k : down * (k + 1)], braille) for k in range(height)]
    for number, place in places:
        x, y = _cells(np.atleast_2d(place), low, high, scale, aspect)
        _write(rows_of[min(int(y[0]) // down, height - 1)], int(x[0]) // across, str(number))
    return ["".join(row).rstrip(chr(_BLANK) + " ") for row in rows_of]


def _cells(
    points: FloatArray, low: FloatArray, high: FloatArray, scale: float, aspect: float
) -> tuple[np.ndarray, np.ndarray]:
    return (
        np.floor((points[:, 0] - low[0]) * scale).astype(int),
        np.floor((high[1] - points[:, 1]) * scale / aspect).astype(int),
    )


def _densified(line: FloatArray, step_m: float) -> FloatArray:
    lengths = np.hypot(*np.diff(line, axis=0).T)
    parts = [
        np.linspace(line[k], line[k + 1], max(int(np.ceil(length / step_m)), 1) + 1) for k, length in enumerate(lengths)
    ]
    return np.concatenate(parts) if parts else line


def _row(dots: np.ndarray, braille: bool) -> list[str]:
    if not braille:
        return ["." if each else " " for each in dots[0]]
    cells = [[dots[y, 2 * k + x] * _DOTS[y][x] for y in range(4) for x in range(2)] for k in range(dots.shape[1] // 2)]
    return [chr(_BLANK + int(sum(cell))) for cell in cells]


def _write(row: list[str], column: int, text: str) -> None:
    """Write a number beside its place unless another one is there."""
    for shift in (0, -1, 1, -2, 2):
        begin = column + shift
        cells = row[max(begin - 1, 0) : begin + len(text) + 1]
        if begin >= 0 and begin + len(text) <= len(row) and not any(cell.isdigit() for cell in cells):
            row[begin : begin + len(text)] = text
            return
