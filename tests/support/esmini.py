"""Playing exported scenarios in esmini, without a window.

esmini is the program that the variable ESMINI names, or `esmini` on the path. Tests of it have the mark `esmini`;
without the program they are skipped, and with HARNESS_REQUIRE_ESMINI=1 they fail.
"""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.export.exported_game import BUILDING, Body
from tests.support.tiny import PATIENCE_S

_COLUMNS = {
    "Entity_Name": "name",
    "World_Position_X": "x_m",
    "World_Position_Y": "y_m",
    "World_Heading_Angle": "heading_rad",
    "bb_x": "back_m",
    "bb_length": "length_m",
    "bb_width": "width_m",
}


def require_esmini() -> Path:
    """The program; skips the test where there is none."""
    found = os.environ.get("ESMINI") or shutil.which("esmini")
    if not found or not Path(found).is_file():
        what = "esmini is not installed: name it by ESMINI=/path/to/bin/esmini"
        if os.environ.get("HARNESS_REQUIRE_ESMINI") == "1":
            pytest.fail(f"{what}, and HARNESS_REQUIRE_ESMINI=1 requires it")
        pytest.skip(what)
    return Path(found).absolute()


def play(scenario: Path, step_s: float, scratch: Path) -> tuple[pd.DataFrame, str]:
    """What esmini plays: the centre of each entity's body in each step; and what it logs."""
    esmini = require_esmini()
    command = [str(esmini), "--osc", str(scenario.absolute()), "--headless", "--fixed_timestep", f"{step_s:g}"]
    command += ["--csv_logger", "played.csv", "--disable_stdout"]
    command += ["--traj_filter", "0"]  # by default samples within 0.1 m of one another are joined
    done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    log = (scratch / "log.txt").read_text()
    assert done.returncode == 0, done.stdout + done.stderr + log
    with (scratch / "played.csv").open() as file:
        lines = list(csv.reader(file, skipinitialspace=True))
    header = next(place for place, line in enumerate(lines) if line[:1] == ["Index [-]"])
    titles = [title.partition("[")[0].removeprefix("#1 ").strip() for title in lines[header]]
    width = sum(title.startswith("#1 ") for title in lines[header])
    places = {name: titles.index(title) - 2 for title, name in _COLUMNS.items()}
    rows = []
    for line in lines[header + 1 :]:
        for first in range(2, len(line), width):
            entity = line[first : first + width]
            if len(entity) > max(places.values()):
                rows.append({"time_s": line[1], **{name: entity[place] for name, place in places.items()}})
    played = pd.DataFrame(rows)
    numbers = [name for name in played.columns if name != "name"]
    played[numbers] = played[numbers].astype(float)
    played["x_m"] += played["back_m"] * np.cos(played["heading_rad"])
    played["y_m"] += played["back_m"] * np.sin(played["heading_rad"])
    return played, log


def largest_difference_m(played: pd.DataFrame, bodies: tuple[Body, ...], step_s: float) -> float:
    """The largest distance of a played body from its course. Fails if a body is there in other steps than recorded, has
    another size, or turns otherwise.

    esmini carries out an event in the step after the one in which its condition becomes true: bodies that appear or
    leave during the game do so a step late.
    """
    played = played.assign(step=np.rint(played["time_s"] / step_s).astype(int))
    largest, game_ends = 0.0, max(body.first_step + len(body.time_s) for body in bodies if body.kind is not BUILDING)
    for body in bodies:
        if body.kind is BUILDING:
            continue
        late, ends = int(body.first_step > 0), body.first_step + len(body.time_s)
        rows = played[(played["name"] == body.name) & (played["step"] < game_ends)].sort_values("step")
        assert rows["step"].tolist() == list(range(body.first_step + late, ends + body.leaves)), body.name
        rows = rows[rows["step"] < ends]
        np.testing.assert_allclose(rows["length_m"], body.length_m, atol=1e-6)
        np.testing.assert_allclose(rows["width_m"], body.width_m, atol=1e-6)
        turned = np.angle(np.exp(1j * (rows["heading_rad"].to_numpy() - body.heading_rad[late:])))
        away_m = np.hypot(rows["x_m"] - body.x_m[late:], rows["y_m"] - body.y_m[late:])
        assert np.abs(turned).max(initial=0.0) < 1e-3, body.name
        largest = max(largest, float(away_m.max() if len(away_m) else 0.0))
    return largest
