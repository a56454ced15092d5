"""The pictures of a film: the caption, the name of each player and the contacts on them, and their encoding.

A GIF is encoded by Pillow, an MP4 by ffmpeg (on PATH, or that of the package imageio-ffmpeg).
"""

from __future__ import annotations

import importlib
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import pandas as pd
from PIL import Image, ImageDraw, ImageFont

from harness.errors import HarnessError
from harness.game.arrays import FloatArray
from harness.replay.vehicles import PLAYER_COLOURS, shown_name

_CAPTION_PX, _LABEL_PX = 16, 14
_CORNER_PX = (12, 10)
_AWAY_M = 3.5  # of the middle of a label from the middle of its vehicle
_LEAST_AWAY_PX = 34.0
_RING_PX = 14.0
_INK, _PAPER, _MARGIN_PX = (20, 20, 20), (255, 255, 255), 3
Box: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Label:
    """A name, the pixels of its middle from the middle of the picture (right, up), and those of what it names."""

    name: str
    at_px: tuple[float, float]
    of_px: tuple[float, float]
    ring: str = ""
    """The colour of a ring around what it names; empty: none."""


def labels_at(
    frame: pd.DataFrame,
    names: Mapping[str, str],
    centre_m: FloatArray,
    px_per_m: float,
    *,
    ringed: Collection[str] = (),
) -> list[Label]:
    """The labels of one step's players, whose rows are in `frame`, in a picture around `centre_m` [2].

    The players in `ringed`, too small to be found by their drawing, have a ring of their colour around them.
    The southernmost player has its label below it, every other one above, so that two vehicles side by side keep theirs
    apart.
    """
    players = frame[frame["player"].isin(list(PLAYER_COLOURS))].sort_values(["y_m", "player"])
    away_px = max(_AWAY_M * px_per_m, _LEAST_AWAY_PX)
    labels = []
    for place, row in enumerate(players.itertuples()):
        x_px, y_px = (row.x_m - centre_m[0]) * px_per_m, (row.y_m - centre_m[1]) * px_per_m
        side = -1.0 if place == 0 and len(players) > 1 else 1.0
        labels.append(
            Label(
                name=shown_name(str(row.player), names),
                at_px=(x_px, y_px + side * away_px),
                of_px=(x_px, y_px),
                ring=f"rgb({PLAYER_COLOURS[row.player]})" if row.player in ringed else "",
            )
        )
    return labels


def kept_apart(labels: Sequence[Label]) -> list[Label]:
    """The labels, of which none covers another: one that would is moved away from what it names, up or down."""
    placed: list[Label] = []
    for label in labels:
        away_px = 1.0 if label.at_px[1] >= label.of_px[1] else -1.0
        while any(_overlap(box_px(label), box_px(other)) for other in placed):
            label = replace(label, at_px=(label.at_px[0], label.at_px[1] + away_px))
        placed.append(label)
    return placed


def box_px(label: Label) -> Box:
    """The edges of a label's box from the middle of the picture: left, bottom, right, top."""
    left, top, right, bottom = _font(_LABEL_PX).getbbox(label.name, anchor="mm")
    x, y = label.at_px
    return x + left - _MARGIN_PX, y - bottom - _MARGIN_PX, x + right + _MARGIN_PX, y - top + _MARGIN_PX


def captioned(picture: Image.Image, caption: str, labels: Sequence[Label]) -> Image.Image:
    """The picture with a caption in its corner, and labels on lines that lead to what they name. Each has
    a white background: it can be read on a dark road, too."""
    draw = ImageDraw.Draw(picture)
    left, top, right, bottom = draw.textbbox(_CORNER_PX, caption, font=_font(_CAPTION_PX))
    draw.rectangle([left - _MARGIN_PX, top - _MARGIN_PX, right + _MARGIN_PX, bottom + _MARGIN_PX], fill=_PAPER)
    draw.text(_CORNER_PX, caption, fill=_INK, font=_font(_CAPTION_PX))
    middle = 0.5 * picture.width, 0.5 * picture.height
    for label in labels:
        x, y = middle[0] + label.at_px[0], middle[1] - label.at_px[1]
        # a line up to the label's own edge: its vehicle stays free
        draw.line([(x, y), (x, 0.5 * (y + middle[1] - label.of_px[1]))], fill=_INK, width=1)
        if label.ring:
            x, y = middle[0] + label.of_px[0], middle[1] - label.of_px[1]
            draw.ellipse([x - _RING_PX, y - _RING_PX, x + _RING_PX, y + _RING_PX], outline=label.ring, width=3)
    for label in labels:
        left, bottom, right, top = box_px(label)
        draw.rectangle([middle[0] + left, middle[1] - top, middle[0] + right, middle[1] - bottom], fill=_PAPER)
        at = middle[0] + label.at_px[0], middle[1] - label.at_px[1]
        draw.text(at, label.name, fill=_INK, font=_font(_LABEL_PX), anchor="mm")
    return picture


def _overlap(one: Box, other: Box) -> bool:
    return all(one[axis] < other[axis + 2] and other[axis] < one[axis + 2] for axis in (0, 1))


@lru_cache(maxsize=2)
def _font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size_px)


FORMATS = (".gif", ".mp4")
_COLOURS = 64  # of a GIF: the road, the cars and their edges have far fewer


def find_ffmpeg() -> str | None:
    """ffmpeg on PATH, else that of imageio-ffmpeg, if it is installed."""
    found = shutil.which("ffmpeg")
    if found is None and importlib.util.find_spec("imageio_ffmpeg") is not None:
        try:
            found = str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
        except RuntimeError:  # it has none for this platform
            return None
    return found


def encode(pictures: Iterator[Image.Image], file: Path, size_px: tuple[int, int], interval_s: float) -> None:
    """Write pictures of one size as a film, `interval_s` apart. Raises HarnessError with ffmpeg's message."""
    if file.suffix.lower() == ".gif":
        few = (picture.quantize(_COLOURS, dither=Image.Dither.NONE) for picture in pictures)
        next(few).save(file, save_all=True, append_images=few, duration=round(1000 * interval_s), loop=0)
        return
    program = find_ffmpeg()
    assert program is not None, "film_problems has checked for it"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size_px[0]}x{size_px[1]}", "-r", f"{1.0 / interval_s:g}"]
    # browsers and presentation programs need yuv420p and the index at the front
    coded = ["-pix_fmt", "yuv420p", "-movflags", "+faststart", str(file)]
    with tempfile.TemporaryFile() as log:
        ffmpeg = subprocess.Popen(
            [program, "-y", "-loglevel", "error", *raw, "-i", "-", *coded],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
        assert ffmpeg.stdin is not None
        try:
            for picture in pictures:
                ffmpeg.stdin.write(picture.tobytes())
            ffmpeg.stdin.close()
        except BrokenPipeError:
            pass  # ffmpeg's message is reported below
        except BaseException:
            ffmpeg.kill()
            ffmpeg.wait()
            raise
        if ffmpeg.wait() != 0:
            log.seek(0)
            raise HarnessError(f"ffmpeg can't write the film: {log.read().decode(errors='replace').strip()}")
