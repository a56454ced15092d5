"""Installed packages as drivers: entry points of the group `harness.drivers`.

    [project.entry-points."harness.drivers"]
    my_driver = "my_package:driver"

Such an entry point is a callable: given the car (`harness.drivers.car.Car`) and the document's parameters as keywords
it returns a `harness.drivers.protocol.Driver`.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.config.toml_reading import nearest
from harness.drivers.car import Car
from harness.drivers.protocol import Driver
from harness.errors import DriverError, UsageError

GROUP = "harness.drivers"


def installed_names() -> list[str]:
    """The drivers that installed packages offer."""
    return sorted({each.name for each in importlib.metadata.entry_points(group=GROUP)})


def entry_point(name: str, file: object, key: str) -> importlib.metadata.EntryPoint:
    """An installed driver. Raises UsageError, for this key of this file, where there is none or more than one."""
    found = [each for each in importlib.metadata.entry_points(group=GROUP) if each.name == name]
    packages = sorted({each.dist.name for each in found if each.dist is not None})
    if not found:
        remedy = nearest(name, installed_names() or ["(no installed package offers a driver)"])
        raise UsageError.of(file, key, f"no installed package offers a driver {name!r}", remedy)
    if len(packages) > 1:
        message = f"several packages offer a driver {name!r}: {', '.join(packages)}"
        raise UsageError.of(file, key, message, "uninstall all but one")
    return found[0]


def version_of(point: importlib.metadata.EntryPoint) -> dict[str, str]:
    """What tells an installed driver from another: package, version, and a hash of the code, for a package that is
    being worked on changes without its version."""
    package = point.dist
    return {
        "package": package.name if package is not None else "",
        "version": package.version if package is not None else "",
        "value": point.value,
        "code": _code(point.module),
    }


def installed_driver(point: importlib.metadata.EntryPoint, car: Car, parameters: Mapping[str, Any]) -> Driver:
    """Make an installed driver. Raises DriverError where the package fails to, or makes something else."""
    try:
        made = point.load()(car, **parameters)
    except Exception as error:  # a package may raise what it likes
        message = f"{point.name} ({point.value}) can't be made: {type(error).__name__}: {error}"
        raise DriverError(message) from error
    if not isinstance(made, Driver):
        lacks = [name for name in ("takes_over", "reset", "decide") if not hasattr(made, name)]
        raise DriverError(f"{point.name} ({point.value}) made a {type(made).__name__} without {', '.join(lacks)}")
    return made


def _code(module: str) -> str:
    """The hash of the Python files of a module's top package."""
    try:
        spec = importlib.util.find_spec(module.partition(".")[0])
    except (ImportError, ValueError):
        return ""
    if spec is None:
        return ""
    folders = [Path(each) for each in spec.submodule_search_locations or ()]
    files = [file for folder in folders for file in folder.rglob("*.py")] or [Path(spec.origin or "")]
    digest = hashlib.sha256()
    for file in sorted(each for each in files if each.is_file()):
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
