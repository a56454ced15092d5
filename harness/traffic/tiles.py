"""Tiled nets: G copies of a scene's net side by side in one net, so that one SUMO plays G games.

netconvert prefixes the names and shifts the coordinates of each copy. The tiled net is cached by the net's content, the
number of games and SUMO's version.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import logging
import os
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import platformdirs
import sumo

from harness.errors import SimulationError
from harness.traffic.xml_file import parse_xml

_GAP_M = 200.0
_MOST_AT_ONCE = 8  # netconverts that shift a tile each
_LOGGER = logging.getLogger("harness.preparation")


def tile_prefix(game: int, games: int) -> str:
    """The prefix of every name in a game's tile; empty if there is one game."""
    return f"g{game}_" if games > 1 else ""


def tile_offset_m(net_file: Path, games: int) -> float:
    """Distance from each tile to the next one, in y; 0 for one game."""
    location = parse_xml(net_file).find("location")
    if games == 1 or location is None:
        return 0.0
    _, low, _, high = (float(each) for each in location.get("convBoundary", "0,0,0,0").split(","))
    return float(round(high - low + _GAP_M))


def tiled_net(net_file: Path, games: int) -> Path:
    """A net with G = `games` tiles of the scene's net: the net itself for one game, else a file of the cache.

    Raises SimulationError if netconvert fails.
    """
    if games == 1:
        return net_file
    version = importlib.metadata.version("eclipse-sumo")  # `sumo.__version__` is 0.0.0
    digest = hashlib.sha256(net_file.read_bytes() + f"{games} {_GAP_M} {version}".encode()).hexdigest()[:24]
    cache = Path(platformdirs.user_cache_dir("harness")) / "tiles"
    cache.mkdir(parents=True, exist_ok=True)
    merged = cache / f"{digest}.net.xml"
    if not merged.exists():
        with tempfile.TemporaryDirectory(dir=cache) as scratch:
            os.replace(_merge(net_file, games, Path(scratch)), merged)
    return merged


def _merge(net_file: Path, games: int, scratch: Path) -> Path:
    offset_m = tile_offset_m(net_file, games)

    def tile(game: int) -> str:
        copy, shift_m = scratch / f"{game}.net.xml", game * offset_m
        options = ("--prefix", tile_prefix(game, games), "--offset.y", str(shift_m), "-o", str(copy))
        _netconvert("-s", str(net_file), *options)
        return str(copy)

    tiles = []
    _log_merging(0, games)
    with ThreadPoolExecutor(min(os.cpu_count() or 1, _MOST_AT_ONCE)) as threads:
        for copy in threads.map(tile, range(games)):
            tiles.append(copy)
            _log_merging(len(tiles), games)
    merged = scratch / "merged.net.xml"
    _netconvert("-s", ",".join(tiles), "--offset.disable-normalization", "-o", str(merged))
    return merged


def _log_merging(done: int, games: int) -> None:
    _LOGGER.info("merging %d copies of the network, once per scene", games, extra={"done": done, "total": games + 1})


def _netconvert(*arguments: str) -> None:
    program = shutil.which("netconvert", path=os.path.join(sumo.SUMO_HOME, "bin"))
    if program is None:
        raise SimulationError("netconvert is missing from the installed SUMO: install eclipse-sumo again")
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    run = subprocess.run([program, *arguments], capture_output=True, text=True, env=environment, check=False)
    if run.returncode:
        raise SimulationError(f"netconvert failed: {run.stderr.strip()[-500:]}")
