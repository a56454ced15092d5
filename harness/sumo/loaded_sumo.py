"""SUMO in this process, with the tiles of one or more simulations. libsumo allows one SUMO per process.

The simulations can share it (`scene_games.can_share`). Each of their steps is one step of SUMO: it is made after all
of them have placed their players, by the first one that is stepped.
"""

from __future__ import annotations

import contextlib
import tempfile
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.errors import SimulationError
from harness.road.net.tiles import Copies, tiled_net, tiles_of
from harness.road.scene.open_scene import OpenScene
from harness.sumo.insertion import TYPES_XML
from harness.sumo.scene_games import SceneGames
from harness.sumo.simulation import Tiles, TypeNames


class LoadedSumo:
    """The SUMO of this process. `close`, or the end of this object, releases libsumo."""

    def __init__(self, parts: Sequence[SceneGames], seed: int) -> None:
        """Load SUMO with the tiles of all parts, which can share it. Raises SimulationError if SUMO refuses or is in
        use."""
        if libsumo.isLoaded():
            raise SimulationError("this process has a libsumo simulation already")
        scenes = [part.scene for part in parts]
        self._scenes = " and ".join(dict.fromkeys(repr(scene.document.name) for scene in scenes))
        copies = [Copies(part.scene.net_file, part.games, part.scene.junctions) for part in parts]
        tiles = tiles_of(copies, in_one_place=all(part.in_one_place for part in parts))
        folder = tempfile.TemporaryDirectory(prefix="harness-sumo-")
        names, files = _write_types(scenes, Path(folder.name))
        self.tiles = [
            Tiles(
                prefixes=[tile.prefix for tile in own],
                offsets_m=np.array([tile.offset_m for tile in own]),
                roads_m=scene.roads_m,
                types=types,
            )
            for own, scene, types in zip(tiles, scenes, names, strict=True)
        ]
        self.steps = self.loads = 0
        self.placed: set[int] = set()
        """The parts that have placed their players since the last step, by their number."""
        net = tiled_net([tile for own in tiles for tile in own])
        route_files = ",".join(map(str, files))
        self._options = ["--net-file", str(net), "--route-files", route_files, *parts[0].options]
        self._release = weakref.finalize(self, _release, folder)
        try:
            self._load(["sumo", *self._options, "--seed", str(seed)], libsumo.start)
        except SimulationError:
            self.close()
            raise

    @contextlib.contextmanager
    def calls(self, action: str) -> Iterator[None]:
        """A block of calls: libsumo's errors in it become a SimulationError that names the action."""
        if not self._release.alive:
            raise SimulationError(f"SUMO can't {action}: this simulation was closed")
        try:
            yield
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            raise SimulationError(f"SUMO could not {action}: {error}") from error

    def reload(self, seed: int) -> None:
        """Load everything again, with random numbers from another seed."""
        self._load([*self._options, "--seed", str(seed)], libsumo.load)

    def step(self) -> None:
        """Raises SimulationError if a simulation has not placed its players."""
        if len(self.placed) < len(self.tiles):
            raise SimulationError(f"{len(self.placed)} of {len(self.tiles)} simulations have placed their players")
        _libsumo.simulation_step()
        self.steps += 1
        self.placed.clear()

    def close(self) -> None:
        self._release()

    def _load(self, options: list[str], load: Callable[[list[str]], object]) -> None:
        with self.calls(f"load scene {self._scenes}"):
            load(options)
        self.steps = 0
        self.placed.clear()
        self.loads += 1


def _write_types(scenes: Sequence[OpenScene], folder: Path) -> tuple[list[TypeNames], list[Path]]:
    """Write the vehicle types of the scenes. Returns their names in SUMO for each scene, and the files. Scenes whose
    types differ may use the same ids: the names of those after the first have a prefix."""
    texts = [scene.routes.types_xml.replace("</routes>", f"{TYPES_XML}</routes>") for scene in scenes]
    names: dict[str, TypeNames] = {}
    files = []
    for text in dict.fromkeys(texts):
        types = ElementTree.fromstring(text)
        ids = frozenset(each.get("id", "") for each in types.iter() if each.get("id") is not None)
        names[text] = of_scene = TypeNames(f"scene{len(names)}_" if names else "", ids)
        for each in types.iter():
            for attribute in ("id", "vTypes"):
                if attribute in each.attrib:
                    each.set(attribute, " ".join(map(of_scene.in_sumo, each.attrib[attribute].split())))
        files.append(folder / f"types{len(names)}.rou.xml")
        ElementTree.ElementTree(types).write(files[-1], encoding="utf-8")
    return [names[text] for text in texts], files


def _release(folder: tempfile.TemporaryDirectory[str]) -> None:
    libsumo.close()
    folder.cleanup()
