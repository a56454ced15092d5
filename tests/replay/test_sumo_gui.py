"""A replay in SUMO-GUI on a virtual screen: the players are at their places of the trace."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image, ImageGrab

from harness.replay import follow_in_sumo_gui, sumo_gui
from harness.replay.contacts import contacts
from harness.replay.gui_settings import choose_view
from harness.replay.sumo_gui import find_xvfb, virtual_screen
from harness.replay.vehicles import types_of_vehicles
from harness.sumo import gui
from harness.sumo.gui import SUMO_GUI
from tests.support.pictures import blue, orange, require_gui
from tests.support.replays import GAMES, RAILS, ROUTES, STEP_S, collision_game, write

DIALOGUE_RGB = (212, 208, 200)
"""The colour of SUMO-GUI's dialogues and tool bars."""


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """The name of a virtual screen."""
    require_gui()
    xvfb = find_xvfb()
    assert xvfb is not None
    with virtual_screen(xvfb, (1400, 900)) as name:
        yield name


def photograph(folder: Path, screen: str, steps: list[int]) -> list[np.ndarray]:
    """RGB pictures [height, width, 3] that SUMO-GUI takes of the given steps of the game."""
    settings = (folder / "view.xml").read_text()
    settings = re.sub(r"<(breakpoint|delay) [^>]*>", "", settings)
    files = [folder / f"step{step}.png" for step in steps]
    taken = "".join(
        f'<snapshot file="{file.name}" time="{(step + 1) * STEP_S:.1f}"/>'
        for file, step in zip(files, steps, strict=True)
    )
    (folder / "view.xml").write_text(settings.replace("</viewsettings>", taken + "</viewsettings>"))
    command = [str(SUMO_GUI), "-c", str(folder / "scene.sumocfg"), "--quit-on-end"]
    environment = os.environ | {"DISPLAY": screen}
    for _ in range(5):  # SUMO-GUI dies of SIGSEGV, does not end, or takes pictures of one pixel now and then
        with contextlib.suppress(subprocess.TimeoutExpired):
            done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
            if done.returncode >= 0:
                assert done.returncode == 0, done.stderr
                pictures = [np.asarray(Image.open(file).convert("RGB")).astype(int) for file in files]
                if all(picture.size > 3 for picture in pictures):
                    return pictures
    pytest.fail("SUMO-GUI died, did not end or took no picture in five attempts")


def place(mask: np.ndarray, trace: pd.DataFrame, net: Path) -> tuple[float, float]:
    """The centre of the marked pixels in net coordinates."""
    found = contacts(trace, types_of_vehicles(trace, ROUTES), RAILS)
    view = choose_view(trace, found)
    height, width = mask.shape
    metres = max(view.width_m / width, view.height_m / height)  # per pixel
    rows, columns = np.nonzero(mask)
    low, high = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()])
    x, y = 0.5 * (low + high) - 0.5 * np.array([width, height])
    return view.x_m + x * metres, view.y_m - y * metres


@pytest.mark.parametrize(("name", "step"), [("clean", 70), ("clean", 153), ("collision", 15), ("rail", 22)])
def test_gui__shows_both_cars_where_the_trace_has_them(
    name: str, step: int, screen: str, merge_net: Path, tmp_path: Path
) -> None:
    trace = GAMES[name]()
    (picture,) = photograph(write(trace, merge_net, tmp_path / "replay"), screen, [step])
    expected = trace[trace["step"] == step].set_index("player")
    for player, mask in (("ego", blue(picture)), ("non_ego", orange(picture))):
        assert mask.any(), f"{player} can't be seen"
        x_m, y_m = place(mask, trace, merge_net)
        assert abs(x_m - expected.loc[player, "x_m"]) < 1.5
        assert abs(y_m - expected.loc[player, "y_m"]) < 1.0


def test_gui__prints_the_label_of_a_contact_on_white_above_the_road(
    screen: str, merge_net: Path, tmp_path: Path
) -> None:
    trace = collision_game()
    (picture,) = photograph(write(trace, merge_net, tmp_path / "replay"), screen, [15])
    found = contacts(trace, types_of_vehicles(trace, ROUTES), RAILS)
    view = choose_view(trace, found)
    height, width = picture.shape[:2]
    per_px = max(view.width_m / width, view.height_m / height)
    column = round(0.5 * width + (found[0].x_m - view.x_m) / per_px)
    row = round(0.5 * height - (found[0].y_m + 8.0 - view.y_m) / per_px)
    around = picture[row + 8 : row + 20, column - 20 : column + 20]  # SUMO-GUI prints it below its place
    assert (around.min(-1) > 240).mean() > 0.4
    assert (around.max(-1) < 120).mean() > 0.05  # the letters


def test_gui__follows_the_ego_and_halts_at_the_contact(
    screen: str, merge_net: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = collision_game()
    folder = write(trace, merge_net, tmp_path / "replay")
    settings = folder / "view.xml"
    settings.write_text(re.sub(r"<delay [^>]*>", '<delay value="20"/>', settings.read_text()))
    monkeypatch.setenv("DISPLAY", screen)
    started: list[subprocess.Popen[bytes]] = []

    class Noted(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *arguments: object, **options: object) -> None:
            super().__init__(*arguments, **options)  # type: ignore[call-overload]
            started.append(self)

    monkeypatch.setattr(gui.subprocess, "Popen", Noted)
    opened = threading.Event()
    watching = threading.Thread(target=follow_in_sumo_gui, args=(folder, opened.set), daemon=True)
    watching.start()
    try:
        assert opened.wait(300.0)
        pictures = settled(screen)
        assert watching.is_alive()  # at a halt; otherwise the game would be over
    finally:
        started[0].kill()  # as when its user closes it
    watching.join(300.0)
    assert not watching.is_alive()

    contact = trace[trace["outcome"] == "collision"]["step"].min()
    expected = trace[trace["step"] == contact].set_index("player")
    places = {name: middle(mask(pictures)) for name, mask in (("ego", blue), ("non_ego", orange))}
    canvas = np.argwhere(blue(pictures) | orange(pictures) | ground(pictures))
    centre = 0.5 * (canvas.min(0) + canvas.max(0))
    assert abs(places["ego"][1] - centre[1]) < 30  # pixels; SUMO-GUI follows the front bumper
    metre = (canvas.max(0) - canvas.min(0))[1] / sumo_gui.FOLLOWED_M[0]
    apart = (places["non_ego"][1] - places["ego"][1]) / metre
    assert apart == pytest.approx(expected.loc["non_ego", "x_m"] - expected.loc["ego", "x_m"], abs=0.8)


def test_gui__asks_no_question_in_front_of_the_last_picture(screen: str, merge_net: Path, tmp_path: Path) -> None:
    folder = write(collision_game(), merge_net, tmp_path / "replay")
    settings = (folder / "view.xml").read_text()
    settings = re.sub(r"<delay [^>]*>", '<delay value="20"/>', settings)
    settings = settings.replace('<breakpoint time="3.300" />', "")  # of the contact: the halt at the end is left
    (folder / "view.xml").write_text(settings)
    gui = subprocess.Popen([str(SUMO_GUI), "-c", "scene.sumocfg"], cwd=folder, env=os.environ | {"DISPLAY": screen})
    try:
        picture = settled(screen)
    finally:
        gui.kill()
        gui.wait(timeout=300)
    rows, columns = np.nonzero(ground(picture))
    canvas = picture[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    assert blue(canvas).any()
    assert orange(canvas).any()
    assert (canvas == DIALOGUE_RGB).all(-1).mean() < 0.01


def settled(screen: str) -> np.ndarray:
    """The picture of the screen [height, width, 3] once it does not change."""
    before, since = np.zeros(0), time.monotonic()
    deadline = since + 300.0
    while time.monotonic() < deadline:
        now = np.asarray(ImageGrab.grab(xdisplay=screen).convert("RGB")).astype(int)
        if not np.array_equal(now, before) or not blue(now).any():
            before, since = now, time.monotonic()
        elif time.monotonic() - since > 2.0:
            return now
        time.sleep(0.2)
    pytest.fail("SUMO-GUI never comes to rest")


def middle(mask: np.ndarray) -> np.ndarray:
    """Row and column of the centre of the largest group of marked pixels: toolbars also have blue pixels."""
    rows = np.argwhere(mask)
    rows = rows[np.abs(rows - np.median(rows, axis=0)).max(1) < 60]
    return 0.5 * (rows.min(0) + rows.max(0))


def ground(picture: np.ndarray) -> np.ndarray:
    return (picture == (214, 224, 206)).all(-1)
