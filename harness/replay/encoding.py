"""Encode pictures as a film: GIF by Pillow, MP4 by ffmpeg (on PATH, or that of the package imageio-ffmpeg)."""

from __future__ import annotations

import importlib
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

from harness.errors import HarnessError, Problem

FORMATS = (".gif", ".mp4")
_COLOURS = 64  # of a GIF: the road, the cars and their edges have far fewer


def encoding_problem(file: Path) -> Problem | None:
    """The missing program for a film of this name; None if nothing is missing."""
    if file.suffix.lower() == ".mp4" and find_ffmpeg() is None:
        remedy = "apt-get install ffmpeg, or pip install imageio-ffmpeg; a .gif needs neither"
        return Problem("ffmpeg", "", "is not installed, and an .mp4 needs it", remedy)
    return None


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
        _gif(pictures, file, interval_s)
    else:
        _mp4(pictures, file, size_px, interval_s)


def _gif(pictures: Iterator[Image.Image], file: Path, interval_s: float) -> None:
    few = (picture.quantize(_COLOURS, dither=Image.Dither.NONE) for picture in pictures)
    first = next(few)
    first.save(file, save_all=True, append_images=few, duration=round(1000 * interval_s), loop=0)


def _mp4(pictures: Iterator[Image.Image], file: Path, size_px: tuple[int, int], interval_s: float) -> None:
    program = find_ffmpeg()
    assert program is not None, "encoding_problem has checked for it"
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
