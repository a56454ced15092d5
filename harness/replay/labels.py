"""The writing on a film's pictures: the caption, and the name of each player beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import pandas as pd
from PIL import Image, ImageDraw, ImageFont

from harness.game.arrays import FloatArray
from harness.replay.vehicles import PLAYER_COLOURS, shown_name

_CAPTION_PX, _LABEL_PX = 16, 14
_AWAY_M = 3.5  # of the middle of a label from the middle of its vehicle
_LEAST_AWAY_PX = 34.0
_INK, _PAPER, _MARGIN_PX = (20, 20, 20), (255, 255, 255), 3


@dataclass(frozen=True, kw_only=True)
class Label:
    """A name, the pixels of its middle from the middle of the picture (right, up), and those of its vehicle."""

    name: str
    at_px: tuple[float, float]
    of_px: tuple[float, float]


def labels_at(frame: pd.DataFrame, names: Mapping[str, str], centre_m: FloatArray, px_per_m: float) -> list[Label]:
    """The labels of one step's players, whose rows are in `frame`, in a picture around `centre_m` [2].

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
            Label(name=shown_name(str(row.player), names), at_px=(x_px, y_px + side * away_px), of_px=(x_px, y_px))
        )
    return labels


def captioned(picture: Image.Image, caption: str, labels: Sequence[Label]) -> Image.Image:
    """The picture with a caption in its corner and the labels."""
    draw = ImageDraw.Draw(picture)
    draw.text((12, 10), caption, fill=_INK, font=_font(_CAPTION_PX))
    middle = 0.5 * picture.width, 0.5 * picture.height
    for label in labels:
        x, y = middle[0] + label.at_px[0], middle[1] - label.at_px[1]
        box = draw.textbbox((x, y), label.name, font=_font(_LABEL_PX), anchor="mm")
        # a line up to the label's own edge: its vehicle stays free
        draw.line([(x, y), (x, 0.5 * (y + middle[1] - label.of_px[1]))], fill=_INK, width=1)
        draw.rectangle(
            [box[0] - _MARGIN_PX, box[1] - _MARGIN_PX, box[2] + _MARGIN_PX, box[3] + _MARGIN_PX], fill=_PAPER
        )
        draw.text((x, y), label.name, fill=_INK, font=_font(_LABEL_PX), anchor="mm")
    return picture


@lru_cache(maxsize=2)
def _font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size_px)
