"""Which route files of other projects the harness reads, and the reasons for which it refuses the others.

    python -m benchmarks.route_files FOLDER...

Each route file below the folders is read and, if its net is there too, checked against the net as a scene's route file
is: over the whole time of the file, with routes for all its trips. The net and the additional files are those of the
SUMO configuration that names the route file, otherwise the only net beside it. Additional files that the harness does
not read are left out. SUMO itself runs the file for 100 s, as
a comparison.
"""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import sumo
from defusedxml import ElementTree

from harness.errors import UsageError
from harness.road.demand.departures import check_departures
from harness.road.demand.route_reading import read_route_file
from harness.road.demand.trips import with_routes
from harness.road.net import network

_ENDINGS = (".rou.xml", ".rou.alt.xml", ".trips.xml", ".flows.xml")
_LONGEST_REASON = 150


@dataclass(frozen=True)
class Sources:
    """The files that belong to a route file."""

    net: Path | None = None
    additional: tuple[Path, ...] = ()
    begin_s: float = 0.0


def main(arguments: Sequence[str]) -> None:
    """Print a table of the route files below folders."""
    if not arguments:
        sys.exit(__doc__)
    count: Counter[str] = Counter()
    print("| route file | net | SUMO 1.28 | the harness |\n| --- | --- | --- | --- |")
    for folder in map(Path, arguments):
        named = dict(_configured(folder))
        for file in sorted(_route_files(folder)):
            sources = named.get(file.resolve()) or _beside(file)
            said, own = _sumo(file, sources), _reason(file, sources)
            verdict = "loads" if not own else "refused, as by SUMO" if said not in ("runs", "") else "refused"
            count[verdict] += 1
            net = sources.net.name if sources.net else ""
            print(f"| {file.relative_to(folder)} | {net} | {said} | {own or 'loads'} |", flush=True)
    print(
        f"\n{sum(count.values())} files: " + ", ".join(f"{each} {verdict}" for verdict, each in sorted(count.items()))
    )


def _route_files(folder: Path) -> Iterator[Path]:
    for file in folder.rglob("*.xml*"):
        if file.name.removesuffix(".gz").endswith(_ENDINGS):
            yield file


def _configured(folder: Path) -> Iterator[tuple[Path, Sources]]:
    """The sources of each route file that a SUMO configuration names."""
    for file in sorted([*folder.rglob("*.sumocfg"), *folder.rglob("*.sumocfg.disabled")]):
        values = {element.tag: element.get("value", "") for element in ElementTree.parse(file).iter()}

        def paths(option: str, file: Path = file, values: dict[str, str] = values) -> list[Path]:
            names = values.get(option, "").replace(" ", ",").split(",")
            return [(file.parent / name).resolve() for name in names if name and (file.parent / name).exists()]

        nets = paths("net-file")
        for route_file in paths("route-files"):
            if nets:
                yield route_file, Sources(nets[0], tuple(paths("additional-files")), _seconds(values.get("begin", "0")))


def _seconds(time: str) -> float:
    """Seconds of a time in seconds or as hours:minutes:seconds."""
    seconds = 0.0
    for part in time.split(":"):
        seconds = 60.0 * seconds + float(part)
    return seconds


def _beside(file: Path) -> Sources:
    for folder in (file.parent, file.parent.parent):
        nets = [*folder.glob("*.net.xml"), *folder.glob("*.net.xml.gz")]
        if len(nets) == 1:
            return Sources(nets[0])
        if nets:
            break
    return Sources()


def _reason(file: Path, sources: Sources) -> str:
    """The reason for which the harness refuses a route file; empty if it does not."""
    try:
        routes = read_route_file(file, *filter(_is_readable, sources.additional))
        if sources.net is not None:
            net = network.read_net(sources.net)
            routes = with_routes(routes, sources.net, net, routes.within(0.0, float("inf")))
            check_departures(set(), net, routes)
    except UsageError as error:
        first, more = error.problems[0], len(error.problems) - 1
        text = f"{first.key}: {first.message}" + (f" (and {more} more)" if more else "")
        return text.replace("|", "/")[:_LONGEST_REASON]
    return ""


def _is_readable(additional: Path) -> bool:
    """Whether a scene may name an additional file: many only draw or measure."""
    try:
        read_route_file(additional)
    except UsageError:
        return False
    return True


def _sumo(file: Path, sources: Sources) -> str:
    """What SUMO says of a route file."""
    if sources.net is None:
        return ""
    additional = ["--additional-files", ",".join(map(str, sources.additional))] if sources.additional else []
    program = Path(sumo.SUMO_HOME) / "bin" / "sumo"
    options = ["--net-file", str(sources.net), "--route-files", str(file), "--begin", str(sources.begin_s), *additional]
    run = subprocess.run(
        [program, *options, "--no-step-log", "--no-warnings", "--end", str(sources.begin_s + 100.0)],
        capture_output=True,
        text=True,
    )
    return "runs" if run.returncode == 0 else run.stderr.strip().splitlines()[0].replace("|", "/")[:_LONGEST_REASON]


if __name__ == "__main__":
    main(sys.argv[1:])
