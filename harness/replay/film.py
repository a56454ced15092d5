"""A replay as a film: SUMO-GUI plays it on a virtual screen, and its pictures become a GIF or an MP4.

The view follows the ego (after it has left, the other player), in real time. Players have their names beside them,
contacts their time, and no text covers another. A caption says which colour is whose, and the film stays on its last
picture for two seconds.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
from PIL import Image

from harness.errors import HarnessError, Problem, UsageError
from harness.game.arrays import FloatArray
from harness.replay.pictures import FORMATS, Label, captioned, encode, find_ffmpeg, kept_apart, labels_at
from harness.replay.scenery import labels_of_contacts
from harness.replay.sumo_gui import find_xvfb, screen_problem, virtual_screen
from harness.replay.vehicles import PLAYER_COLOURS, legend
from harness.road.xml.xml_file import parse_xml
from harness.sumo.gui import WindowClosed, steered_gui

SIZE_PX = (960, 480)
WIDTH_M = 80.0  # of visible road: a car of 4.6 m is 55 pixels long
SMALL_WIDTH_M = 50.0  # with a player on foot or on a bicycle: a person of 0.5 m is then 10 pixels wide
_SMALL_M = 2.5  # the length below which a player is small
MOST_PER_S = 25.0  # pictures; with shorter steps some steps are skipped
HOLD_S = 2.0  # the last picture stays this much longer: it shows how the game ended
_SCREEN_PX = (1280, 800)


def film_problems(file: Path) -> list[Problem]:
    """Every problem that prevents a film in this file, each with its remedy."""
    problems = []
    if file.suffix.lower() not in FORMATS:
        problems.append(Problem(str(file), "", "is neither .gif nor .mp4", "name it film.gif or film.mp4"))
    elif file.suffix.lower() == ".mp4" and find_ffmpeg() is None:
        remedy = "apt-get install ffmpeg, or pip install imageio-ffmpeg; a .gif needs neither"
        problems.append(Problem("ffmpeg", "", "is not installed, and an .mp4 needs it", remedy))
    if not file.parent.is_dir():
        problems.append(Problem(str(file.parent), "", "is not a folder", "create it first"))
    if find_xvfb() is None and screen_problem("") is not None:
        remedy = "apt-get install xvfb libgl1 libgl1-mesa-dri libglu1-mesa libegl1, or film on a computer with a screen"
        problems.append(Problem("Xvfb", "", "is not installed, and there is no other screen", remedy))
    return problems


def shown_steps(steps: int, step_length_s: float) -> range:
    """The steps of a game of `steps` steps that a film shows."""
    return range(0, steps + 1, max(math.ceil(1.0 / (MOST_PER_S * step_length_s) - 1e-9), 1))


def write_film(
    folder: Path,
    trace: pd.DataFrame,
    file: Path,
    *,
    title: str,
    step_length_s: float,
    names: Mapping[str, str] = MappingProxyType({}),
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Film a replay folder with its game's trace into a `.gif` or `.mp4`; returns the number of pictures.

    `names` are what players are called, by their names in the trace. `on_progress` is called after each picture with
    the number done and the total. The file appears only when it is complete. Raises UsageError for the problems that
    `film_problems` lists, HarnessError if an installed program fails.
    """
    if problems := film_problems(file):
        raise UsageError(problems)
    shown = shown_steps(int(trace["step"].max()), step_length_s)
    interval_s = step_length_s * shown.step
    small = _small_players(folder)
    centres, width_m = _centres(trace), SMALL_WIDTH_M if small else WIDTH_M
    touches = list(labels_of_contacts(parse_xml(folder / "scene.add.xml")))
    whose = legend(trace, names)

    def pictures(plain: Iterator[Image.Image]) -> Iterator[Image.Image]:
        """The pictures with their captions and labels, the last of them several times."""
        for done, (step, picture) in enumerate(zip(shown, plain, strict=True), 1):
            px_per_m = SIZE_PX[0] / width_m
            labels = labels_at(trace[trace["step"] == step], names, centres[step], px_per_m, ringed=small)
            for text, at_m, contact_m in touches:
                at_px, of_px = ((point - centres[step]) * px_per_m for point in (at_m, contact_m))
                labels.append(Label(name=text, at_px=(at_px[0], at_px[1]), of_px=(of_px[0], of_px[1])))
            yield captioned(picture, f"{title}   {step * step_length_s:.1f} s\n{whose}", kept_apart(labels))
            on_progress(done, len(shown))
        yield from [picture] * round(HOLD_S / interval_s)

    scratch = file.with_name(f".{file.stem}.{os.getpid()}{file.suffix}")
    try:
        with contextlib.ExitStack() as stack:
            work = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="harness-film-")))
            xvfb = find_xvfb()
            display = stack.enter_context(virtual_screen(xvfb, _SCREEN_PX)) if xvfb else None
            plain = _photographed(folder, centres, width_m, shown, work=work, display=display)
            encode(pictures(plain), scratch, SIZE_PX, interval_s)
        os.replace(scratch, file)
    finally:
        scratch.unlink(missing_ok=True)
    return len(shown)


def _photographed(
    folder: Path, centres: FloatArray, width_m: float, shown: range, *, work: Path, display: str | None
) -> Iterator[Image.Image]:
    """SUMO-GUI's pictures of the shown steps, in order, each around its centre [T + 1, 2] (m)."""
    options = ["-c", str(folder / "scene.sumocfg"), "--quit-on-end"]  # also after a failure
    for option, name, left_out in (
        ("--gui-settings-file", "view.xml", r"<(breakpoint|delay) [^>]*>"),  # a halt would wait for the play button
        ("--additional-files", "scene.add.xml", r"<poi [^>]*>"),  # caption and labels of each picture replace texts
    ):
        content = (folder / name).read_text(encoding="utf-8")
        (work / name).write_text(re.sub(left_out, "", content), encoding="utf-8")
        options += [option, str(work / name)]
    picture, height_m = work / "picture.png", width_m * SIZE_PX[1] / SIZE_PX[0]
    with steered_gui(options, display=display, patient=False) as window:
        try:
            # SUMO's first step only inserts the vehicles, and its first picture has another size
            for step in range(-1, shown[-1] + 1):
                if step == -1 or step in shown:
                    x_m, y_m = centres[max(step, 0)].tolist()
                    look = window.wait_until_it_looks_at if step == -1 else window.look_at
                    look(x_m, y_m, width_m, height_m)
                    window.photograph_next(picture, SIZE_PX)
                window.step()
                if step in shown:
                    yield _taken(picture)
        except WindowClosed as error:
            raise HarnessError(f"the film could not be finished: {error}") from error


def _small_players(folder: Path) -> set[str]:
    """The players on foot or on a bicycle: the film shows less road, and a ring around each of them."""
    types = parse_xml(folder / "scene.add.xml").iter("vType")
    lengths_m = {each.get("id", ""): float(each.get("length", "nan")) for each in types}
    return {name for name in PLAYER_COLOURS if lengths_m.get(name, math.inf) < _SMALL_M}


def _taken(file: Path) -> Image.Image:
    if not file.is_file():
        raise HarnessError("SUMO-GUI took no picture: check that its screen has OpenGL (libgl1-mesa-dri)")
    with Image.open(file) as opened:
        picture = opened.convert("RGB")
    file.unlink()
    return picture


def _centres(trace: pd.DataFrame) -> FloatArray:
    """[T + 1, 2] the centre of the view: the ego; where it is absent, a non-ego; else the nearest known centre."""
    centres = np.full((int(trace["step"].max()) + 1, 2), np.nan)
    for player in reversed(list(PLAYER_COLOURS)):
        rows = trace[trace["player"] == player]
        centres[rows["step"].to_numpy()] = rows[["x_m", "y_m"]].to_numpy(float)
    return pd.DataFrame(centres).ffill().bfill().to_numpy()
