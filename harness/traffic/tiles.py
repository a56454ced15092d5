"""Tiled nets: G copies of a scene's net side by side in one net, so that one SUMO plays G games.

The tiled net is cached by the net's content, the number of games, the junctions that are kept, and the format.
"""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from collections.abc import Collection
from pathlib import Path

import platformdirs

from harness.traffic.tiled_file import write_tiles
from harness.traffic.xml_file import parse_xml

_GAP_M = 200.0
_FORMAT = 2  # raised when the same net gives another file
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


def tiled_net(net_file: Path, games: int, junctions: Collection[str] | None = None) -> Path:
    """A net with G = `games` tiles of the scene's net, cut down to these junctions and their edges if they are given.

    One game on the whole net needs no copy; other nets are files of the cache.
    """
    if games == 1 and junctions is None:
        return net_file
    kept = "all" if junctions is None else "\n".join(sorted(junctions))
    key = f"{games} {_GAP_M} {_FORMAT} {kept}".encode()
    digest = hashlib.sha256(net_file.read_bytes() + key).hexdigest()[:24]
    cache = Path(platformdirs.user_cache_dir("harness")) / "tiles"
    cache.mkdir(parents=True, exist_ok=True)
    merged = cache / f"{digest}.net.xml"
    if not merged.exists():
        with tempfile.TemporaryDirectory(dir=cache) as scratch:
            os.replace(_merge(net_file, games, Path(scratch), junctions), merged)
    return merged


def _merge(net_file: Path, games: int, scratch: Path, junctions: Collection[str] | None) -> Path:
    _log_merging(0, games)
    merged = scratch / "merged.net.xml"
    prefixes = [tile_prefix(game, games) for game in range(games)]
    write_tiles(net_file, merged, prefixes, tile_offset_m(net_file, games), junctions)
    _log_merging(games, games)
    return merged


def _log_merging(done: int, games: int) -> None:
    _LOGGER.info("merging %d copies of the network, once per scene", games, extra={"done": done, "total": games + 1})
