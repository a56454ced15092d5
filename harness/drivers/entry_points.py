"""Installed packages as drivers: entry points of the group `harness.drivers`.

    [project.entry-points."harness.drivers"]
    my_driver = "my_package:driver"

The entry point is a callable. Its arguments are the car (`harness.drivers.car.Car`) and, as keywords, the document's
parameters; it returns a `harness.drivers.protocol.Driver`. With the table `[cartesian]` in the document, the driver's
`decide` has a fourth parameter: the views [N] (`harness.game.cartesian_view.CartesianView`) of the games.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.config.toml_reading import nearest
from harness.drivers.car import Car
from harness.drivers.driver_files import sha256_of
from harness.drivers.protocol import Driver
from harness.errors import DriverError, UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView

GROUP = "harness.drivers"


def installed_names() -> list[str]:
    """Names of the drivers of installed packages, sorted."""
    return sorted({each.name for each in importlib.metadata.entry_points(group=GROUP)})


def entry_point(name: str, file: object, key: str) -> importlib.metadata.EntryPoint:
    """The entry point of an installed driver. Raises UsageError, for this key of this file, if no package or more than
    one package provides it."""
    found = [each for each in importlib.metadata.entry_points(group=GROUP) if each.name == name]
    packages = sorted({each.dist.name for each in found if each.dist is not None})
    if not found:
        remedy = nearest(name, installed_names() or ["(no installed package provides a driver)"])
        raise UsageError.of(file, key, f"no installed package provides a driver {name!r}", remedy)
    if len(packages) > 1:
        message = f"several packages provide a driver {name!r}: {', '.join(packages)}"
        raise UsageError.of(file, key, message, "uninstall all but one")
    return found[0]


def version_of(point: importlib.metadata.EntryPoint) -> dict[str, str]:
    """The identity of an installed driver: package, version, entry point, and a hash of its files. The hash is needed
    because a package under development changes without its version."""
    package = point.dist
    return {
        "package": package.name if package is not None else "",
        "version": package.version if package is not None else "",
        "value": point.value,
        "code": _code(point.module),
    }


def installed_driver(
    point: importlib.metadata.EntryPoint, car: Car, parameters: Mapping[str, Any], *, plans: bool = False
) -> Driver:
    """Make an installed driver; `plans`: its `decide` takes views. Raises DriverError if the package raises an error,
    or returns no such driver."""
    try:
        driver = point.load()(car, **parameters)
    except Exception as error:  # a package may raise any exception
        what = f"can't be made: {type(error).__name__}: {error}"
        raise DriverError(f"{point.name} ({point.value}) {what}") from error
    if not isinstance(driver, Driver):
        missing = [name for name in ("takes_over", "reset", "decide") if not hasattr(driver, name)]
        what = f"returned a {type(driver).__name__} without {', '.join(missing)}"
        raise DriverError(f"{point.name} ({point.value}) {what}")
    try:
        inspect.signature(driver.decide).bind(*["games", "observation", "noise", "views"][: 4 if plans else 3])
    except TypeError as error:
        what = f"has another decide: {error}; it gets views with the table [cartesian] in its document, and only then"
        raise DriverError(f"{point.name} ({point.value}) {what}") from None
    return driver


class PackagedPlanner:
    """Drives as an installed driver whose `decide` takes views."""

    def __init__(self, driver: Any, history_s: float) -> None:
        self._driver, self.takes_over, self.history_s = driver, bool(driver.takes_over), history_s
        self._views: Sequence[CartesianView] = ()

    def reset(self, games: IntArray) -> None:
        """Reset games [N]."""
        self._driver.reset(games)

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        """Keep the views [N] for the next decision."""
        self._views = views

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """The driver's actions [N, 2] from observations [N, SIZE], noise [N, 2] and the views."""
        decided: FloatArray = self._driver.decide(games, observation, noise, self._views)
        return decided


def _code(module: str) -> str:
    """SHA-256 over the files of a module's top-level package, weights included, but not what Python and tools leave
    beside them; empty if the package is not found."""
    try:
        spec = importlib.util.find_spec(module.partition(".")[0])
    except (ImportError, ValueError):
        return ""
    if spec is None:
        return ""
    digest = hashlib.sha256()
    for folder in map(Path, spec.submodule_search_locations or ()):
        for file in sorted(each for each in folder.rglob("*") if each.is_file()):
            name = file.relative_to(folder)
            if not any(part == "__pycache__" or part.startswith(".") for part in name.parts):
                digest.update(name.as_posix().encode() + b"\0" + sha256_of(file).encode())
    if not spec.submodule_search_locations and spec.has_location and spec.origin:  # else it is part of Python
        digest.update(sha256_of(Path(spec.origin)).encode())
    return digest.hexdigest()
