"""A picture of SUMO-GUI on a virtual screen, at the moment at which a replay halts."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageChops, ImageGrab

from harness.replay.gui_settings import WINDOW_PX
from harness.replay.sumo_gui import find_xvfb, virtual_screen
from harness.replay.vehicles import PLAYER_COLOURS

STILL_S, PATIENCE_S, LOOKS_S = 4.0, 300.0, 0.5
EGO_PX, SHADES = 500, 40
MARGIN_PX = 100


def halted_replay(folder: Path, run: str, arm: str, episode: int) -> Image.Image:
    """What SUMO-GUI shows when a game of a run below a folder halts the first time.

    Raises RuntimeError without Xvfb, and if SUMO-GUI ends or does not halt.
    """
    xvfb = find_xvfb()
    if xvfb is None:
        raise RuntimeError("Xvfb is not installed")
    replay = [sys.executable, "-m", "harness.cli.main", "replay", run, arm, str(episode)]
    with virtual_screen(xvfb, (WINDOW_PX[0] + MARGIN_PX, WINDOW_PX[1] + MARGIN_PX)) as screen:
        environment = os.environ | {"DISPLAY": screen}
        watching = subprocess.Popen(replay, cwd=folder, env=environment, start_new_session=True)
        try:
            picture = _still(screen, watching)
            return picture.crop(picture.getbbox())  # the screen around the window is black
        finally:
            os.killpg(watching.pid, 9)
            watching.wait()


def _still(screen: str, watching: subprocess.Popen[bytes]) -> Image.Image:
    """The picture of the screen when it has an ego and has not changed for some seconds."""
    before, since = ImageGrab.grab(xdisplay=screen).convert("RGB"), time.monotonic()
    last = since + PATIENCE_S
    while time.monotonic() < last and watching.poll() is None:
        time.sleep(LOOKS_S)
        now = ImageGrab.grab(xdisplay=screen).convert("RGB")
        if ImageChops.difference(now, before).getbbox() or not _has_ego(now):
            before, since = now, time.monotonic()
        elif time.monotonic() - since > STILL_S:
            return now
    raise RuntimeError("SUMO-GUI ended, or did not halt")


def _has_ego(picture: Image.Image) -> bool:
    """Whether so many pixels have nearly the colour of the ego; SUMO-GUI shades its cars, and its tools are small."""
    pixels = np.asarray(picture).astype(int)
    ego = [int(part) for part in PLAYER_COLOURS["ego"].split(",")]
    return int((np.abs(pixels - ego).max(-1) <= SHADES).sum()) >= EGO_PX
