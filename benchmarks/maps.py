"""`python -m benchmarks maps FOLDER...`: what `harness scene new` makes of each map below folders.

For each map: the conflicts that it offers, whether its default scene is written or the map is refused, in how long, and
from how many of 200 starts a rule-based driver reaches the goal alone on each route of the scene.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.maps.map_file import MapKind

STARTS = 200
_ENDINGS = tuple(ending for kind in MapKind for ending in kind.value)
_PATIENCE_S = 600.0
_LONGEST = 160
_TRIAL = """
import sys
from pathlib import Path
from harness.assessment.route_trial import try_routes
from harness.road.scene.open_scene import open_scene
trials = try_routes(open_scene(Path(sys.argv[1])), starts=int(sys.argv[2]))
print(", ".join(f"{each.role} {each.arrived}" for each in trials))
"""


def maps_table(folders: Sequence[Path]) -> Iterator[str]:
    """The lines of a table in Markdown, each as soon as it is known, and a line with the counts of the results."""
    yield f"| map | result | seconds | of {STARTS} starts |\n| --- | --- | ---: | --- |"
    count: Counter[str] = Counter()
    for folder in folders:
        for file in sorted(each for each in folder.rglob("*") if each.name.endswith(_ENDINGS)):
            result, words, seconds, arrived = _made(file)
            count[result] += 1
            yield f"| {file.relative_to(folder)} | {words} | {seconds:.0f} | {arrived} |"
    yield f"\n{count.total()} maps: " + ", ".join(f"{number} {result}" for result, number in sorted(count.items()))


def _made(file: Path) -> tuple[str, str, float, str]:
    """The kind of result of a map, the result in words, the seconds, and the starts that arrive."""
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        command = [str(Path(sys.executable).with_name("harness")), "scene", "new", "made", "--from", str(file)]
        start_s = time.perf_counter()
        try:
            run = subprocess.run(
                [*command, "--out", folder, "--rows", "1"], capture_output=True, text=True, timeout=_PATIENCE_S
            )
        except subprocess.TimeoutExpired:
            return "unfinished", f"unfinished after {_PATIENCE_S:.0f} s", _PATIENCE_S, ""
        seconds = time.perf_counter() - start_s
        if run.returncode == 0:
            words = next(line for line in run.stdout.splitlines() if ": wrote " in line).partition(": wrote ")[0]
            trial = [sys.executable, "-c", _TRIAL, str(Path(folder, "networks", "made")), str(STARTS)]
            arrived = subprocess.run(trial, capture_output=True, text=True).stdout.strip() or "the trial failed"
            return "written", _short(words), seconds, arrived
        said = [line for line in run.stderr.splitlines() if line.strip()] or [f"exit code {run.returncode}"]
        result = "ended by a traceback" if "Traceback" in run.stderr or run.returncode < 0 else "refused"
        return result, f"{result}: {_short(said[0].replace(f'{file}: ', ''))}", seconds, ""


def _short(words: str) -> str:
    return words.replace("|", "/")[:_LONGEST]
