"""Films: players are at their places of the trace, and missing programs are reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from harness.errors import HarnessError
from harness.replay import write_film
from harness.replay.film import SIZE_PX, WIDTH_M, film_problems, shown_steps
from harness.replay.pictures import Label, box_px, captioned, encode, kept_apart, labels_at
from harness.replay.scenery import labels_of_contacts
from harness.road.xml.xml_file import parse_xml
from tests.support.pictures import blue, orange, require_gui
from tests.support.replays import STEP_S, clean_game, collision_game, drive, game, straight, write

PX_PER_M = SIZE_PX[0] / WIDTH_M


def frames(file: Path) -> list[np.ndarray]:
    """The pictures [height, width, 3] of a GIF."""
    with Image.open(file) as film:
        found = []
        for number in range(film.n_frames):
            film.seek(number)
            found.append(np.asarray(film.convert("RGB")).astype(int))
        return found


def place_m(mask: np.ndarray) -> np.ndarray:
    """The centre of the marked pixels relative to the centre of the picture: x, y."""
    rows, columns = np.nonzero(mask)
    x, y = 0.5 * (columns.min() + columns.max()), 0.5 * (rows.min() + rows.max())
    return np.array([x - 0.5 * SIZE_PX[0], 0.5 * SIZE_PX[1] - y]) / PX_PER_M


def test_captioned__can_be_read_on_a_dark_road() -> None:
    asphalt = (70, 70, 90)  # no mixture of ink and paper
    for caption in ("a game  7.5 s", "a game  7.5 s\nblue: ego, orange: speedy"):
        picture = np.asarray(captioned(Image.new("RGB", (400, 200), asphalt), caption, []))
        ink = np.argwhere((picture < 60).all(axis=-1))
        (top, left), (bottom, right) = ink.min(axis=0), ink.max(axis=0)
        around = picture[top - 2 : bottom + 3, left - 2 : right + 3]
        assert not (around == asphalt).all(axis=-1).any()  # nothing but ink and paper


def test_film__shows_the_players_where_the_trace_has_them(merge_net: Path, tmp_path: Path) -> None:
    require_gui()
    trace = collision_game()
    folder, progress = write(trace, merge_net, tmp_path / "replay"), list[tuple[int, int]]()
    count = write_film(
        folder,
        trace,
        tmp_path / "film.gif",
        title="a game",
        step_length_s=STEP_S,
        on_progress=lambda done, total: progress.append((done, total)),
    )
    steps = int(trace["step"].max()) + 1
    assert count == steps
    assert progress == [(k + 1, steps) for k in range(steps)]
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["film.gif", "replay"]
    pictures = frames(tmp_path / "film.gif")
    assert len(pictures) == steps  # the clock makes each picture different
    with Image.open(tmp_path / "film.gif") as film:
        assert film.size == SIZE_PX
        assert film.info["duration"] == 100  # ms: real time

    for step in (0, 10, 25, 32, steps - 1):
        there = trace[trace["step"] == step].set_index("player")[["x_m", "y_m"]]
        assert place_m(blue(pictures[step])) == pytest.approx([0.0, 0.0], abs=0.4)
        apart = (there.loc["non_ego"] - there.loc["ego"]).to_numpy()
        if step != 32:  # there they touch, and one covers a part of the other
            assert place_m(orange(pictures[step])) == pytest.approx(apart, abs=0.5)


def test_film__follows_the_non_ego_after_the_ego_has_left(merge_net: Path, tmp_path: Path) -> None:
    require_gui()
    trace = game(
        drive("ego", straight(60.0, -1.6, 10.0, 8), outcome="goal"), drive("non_ego", straight(30.0, -1.6, 10.0, 12))
    )
    folder = write(trace, merge_net, tmp_path / "replay")
    assert write_film(folder, trace, tmp_path / "film.gif", title="", step_length_s=STEP_S) == 12
    pictures = frames(tmp_path / "film.gif")
    assert place_m(blue(pictures[7])) == pytest.approx([0.0, 0.0], abs=0.4)
    assert not blue(pictures[8]).any()
    assert place_m(orange(pictures[8])) == pytest.approx([0.0, 0.0], abs=0.4)


def test_film__leaves_no_part_of_one_behind(merge_net: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    require_gui()
    folder = write(clean_game(), merge_net, tmp_path / "replay")

    def tired(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(folder, clean_game(), tmp_path / "film.gif", title="", step_length_s=STEP_S, on_progress=tired)
    assert [path.name for path in tmp_path.iterdir()] == ["replay"]


@pytest.mark.parametrize(
    ("steps", "step_length_s", "shown"),
    [(3, 0.1, [0, 1, 2, 3]), (3, 1.0, [0, 1, 2, 3]), (9, 0.01, [0, 4, 8]), (4, 0.04, [0, 1, 2, 3, 4])],
)
def test_film__shows_no_more_than_25_a_second(steps: int, step_length_s: float, shown: list[int]) -> None:
    assert list(shown_steps(steps, step_length_s)) == shown


def test_labels__two_cars_side_by_side_keep_theirs_apart() -> None:
    frame = pd.DataFrame({"player": ["ego", "non_ego", "flow.0"], "x_m": [10.0, 12.0, 0.0], "y_m": [0.0, 3.0, 9.0]})
    ego, speedy = labels_at(frame, {"non_ego": "very_speedy"}, np.array([10.0, 0.0]), 12.0)
    assert (ego.name, ego.of_px, ego.at_px) == ("ego", (0.0, 0.0), (0.0, -42.0))
    assert (speedy.name, speedy.of_px, speedy.at_px) == ("very speedy", (24.0, 36.0), (24.0, 78.0))


def test_labels__a_small_player_has_a_ring_of_its_colour() -> None:
    frame = pd.DataFrame({"player": ["ego", "non_ego"], "x_m": [0.0, 0.0], "y_m": [0.0, 5.0]})
    ego, walker = labels_at(frame, {}, np.array([0.0, 0.0]), 19.2, ringed={"non_ego"})
    assert (ego.ring, walker.ring) == ("", "rgb(255,127,14)")
    asphalt = (70, 70, 90)
    picture = np.asarray(captioned(Image.new("RGB", SIZE_PX, asphalt), "", [ego, walker]))
    rows, columns = np.nonzero(orange(picture.astype(int)))
    ends_px = [columns.min() - 480, columns.max() - 480, 240 - rows.max(), 240 - rows.min()]
    assert ends_px == pytest.approx([-14, 14, 96 - 14, 96 + 14], abs=1)
    assert tuple(picture[240 - 96, 480]) == asphalt  # the player itself is seen


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_labels__one_that_would_be_covered_moves_away_from_what_it_names(side: float) -> None:
    ego = Label(name="ego", at_px=(0.0, side * 90.0), of_px=(0.0, side * 50.0))
    collision = Label(name="collision at 3.2 s", at_px=(20.0, side * 96.0), of_px=(20.0, 0.0))
    far = Label(name="speedy", at_px=(200.0, side * 96.0), of_px=(200.0, 0.0))
    kept = kept_apart([ego, collision, far])
    assert (kept[0], kept[2]) == (ego, far)
    assert kept[1] == replace(collision, at_px=(20.0, kept[1].at_px[1]))
    low, high = sorted((box_px(kept[0]), box_px(kept[1])), key=lambda box: side * box[1])
    between_px = high[1] - low[3] if side > 0.0 else low[1] - high[3]
    assert high == box_px(kept[1])
    assert 0.0 <= between_px < 1.0


def test_labels_of_contacts__have_the_place_and_the_contact(merge_net: Path, tmp_path: Path) -> None:
    folder = write(collision_game(), merge_net, tmp_path / "replay")
    [(text, at_m, contact_m)] = labels_of_contacts(parse_xml(folder / "scene.add.xml"))
    assert text == "collision at 3.2 s"
    assert at_m - contact_m == pytest.approx([0.0, 8.0], abs=0.02)
    crash = collision_game().query("step == 32")[["x_m", "y_m"]].mean()
    assert contact_m == pytest.approx(crash.to_numpy(), abs=2.0)


# --- what is missing ---


def test_problems__all_that_is_missing_with_its_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("harness.replay.pictures.importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("harness.replay.sumo_gui.sys.platform", "linux")
    text = "\n".join(map(str, film_problems(tmp_path / "nowhere" / "film.mp4")))
    for words in (
        "nowhere: is not a folder",
        "Xvfb: is not installed",
        "apt-get install xvfb",
        "ffmpeg: is not installed",
        "a .gif needs neither",
    ):
        assert words in text
    assert "ffmpeg" not in "\n".join(map(str, film_problems(tmp_path / "film.gif")))


def test_film__a_failed_sumo_gui_is_reported_with_its_message(
    merge_net: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_gui()
    folder = write(clean_game(), merge_net, tmp_path / "replay")
    (folder / "episode.fcd.xml").unlink()
    with pytest.raises(HarnessError, match=r"(?s)SUMO-GUI|film"):
        write_film(folder, clean_game(), tmp_path / "film.gif", title="", step_length_s=STEP_S)
    assert not list(tmp_path.glob("*.gif"))


# --- mp4 ---

PICTURES = [Image.new("RGB", (64, 32), (k * 20, 0, 0)) for k in range(5)]


def fake_ffmpeg(folder: Path, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    program = folder / "bin" / "ffmpeg"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")


def test_mp4__ffmpeg_gets_every_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_ffmpeg(tmp_path, f"wc -c > {tmp_path}/bytes", monkeypatch)
    encode(iter(PICTURES), tmp_path / "film.mp4", (64, 32), 0.1)
    assert int((tmp_path / "bytes").read_text()) == 5 * 64 * 32 * 3


def test_mp4__shows_the_message_of_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_ffmpeg(tmp_path, "echo 'no such codec' >&2; exit 1", monkeypatch)
    with pytest.raises(HarnessError, match="no such codec"):
        encode(iter(PICTURES * 50), tmp_path / "film.mp4", (64, 32), 0.1)


def test_gif__has_the_full_duration_without_movement(tmp_path: Path) -> None:
    """Pillow merges equal pictures into one with a longer duration."""
    still = pd.Series([PICTURES[0]] * 4).tolist()
    encode(iter(still), tmp_path / "film.gif", (64, 32), 0.1)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.info["duration"] * film.n_frames == 400
