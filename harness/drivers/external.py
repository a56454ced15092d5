"""External drivers: drivers that a campaign does not train. They are found, hashed, and made for a car.

docs/egos.md says what `driver` of a campaign may be.

Programs, FMUs and files of Stable-Baselines3 are code in files. Campaigns are documents that people exchange: neither a
campaign nor a driver document may start such code. It runs only with the permission of the user, given on the command
line. An installed package needs no permission, because the user has installed it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.config.campaign import LEARNED, SUMO, resolve
from harness.config.driver import (
    DriverDocument,
    Fmu,
    Process,
    Python,
    StableBaselines3,
    Sumo,
    TorchScript,
    WithFiles,
    read_driver,
)
from harness.config.toml_reading import nearest, nearest_beside
from harness.config.tunable import Adjustable, Tunable
from harness.drivers.car import Car
from harness.drivers.driver_files import files_of, find_program, is_file, relative_to, resolve_in, sha256_of
from harness.drivers.driver_kinds import driver_in_words, make_driver
from harness.drivers.entry_points import entry_point, installed_names, version_of
from harness.drivers.fmu import unconnected_inputs
from harness.drivers.policy_file import ARCHIVES, check_no_archive, policy_files, read_policy
from harness.drivers.protocol import Driver, planner_of
from harness.errors import DriverError, UsageError
from harness.game.cartesian_view import CartesianRoad, CartesianView
from harness.game.observation_layout import SIZE
from harness.shipped_documents import find_document, is_name, shipped_names, shipped_policies

ALLOW_CODE = "--allow-code"
_RUNS_CODE = {
    Process: "starts a program",
    Fmu: "runs an FMU, which is a program",
    TorchScript: "runs a TorchScript module, which is a program",
    StableBaselines3: "reads a file of Stable-Baselines3, which may contain pickles: reading them can run any code",
}
_KIND_OF_SUFFIX = {".fmu": "fmu", ".onnx": "onnx", ".pt": "torchscript", ".zip": "stable_baselines3"}


@dataclass(frozen=True, kw_only=True)
class ExternalDriver:
    """A driver that was found, with everything its decisions depend on. It can be pickled for another process."""

    written: str
    """The name of the driver in the campaign."""
    place: Path
    """The folder of a policy, or the folder that paths in the document are relative to."""
    document: DriverDocument | None
    """None: a policy's folder."""
    command: tuple[str, ...] = ()
    """Of a program: its path and arguments. Empty for other kinds."""
    files: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of each file that the driver depends on, by path."""
    package: Mapping[str, str] = field(default_factory=dict)
    """Of an installed driver: package, version, entry point, and a hash of the code."""

    @property
    def kind(self) -> str:
        """The document's `kind`, or "policy"."""
        return "policy" if self.document is None else self.document.kind

    @property
    def vehicle_type(self) -> str | None:
        """The vehicle type of its car; None: the type in the scene."""
        return self.document.vehicle_type if isinstance(self.document, Sumo) else None

    @property
    def identity(self) -> Any:
        """Everything its decisions depend on. It is hashed into the keys of stages."""
        if self.document is None:
            return self.files[str(policy_files(self.place)[1])]
        # Bounds of a search have no effect on decisions, nor has the place of a program: its files are hashed.
        document = self.document.model_dump(mode="json", exclude={"tunable", "folder"})
        return {"document": document, "files": list(self.files.values()), "package": dict(self.package)}

    @property
    def recorded(self) -> dict[str, Any]:
        """The driver's entry in a manifest."""
        return {
            "driver": self.written,
            "kind": self.kind,
            "in_words": self.in_words,
            "document": self.document.record() if self.document is not None else None,
            "files": {os.path.relpath(file, self.place): value for file, value in self.files.items()},
            "package": dict(self.package),
        }

    @property
    def searched(self) -> tuple[Tunable, ...]:
        """The parameters that a search may change; empty: it has none."""
        return self.document.searched if isinstance(self.document, Adjustable) else ()

    @property
    def numbers(self) -> dict[str, float]:
        """The values of those parameters, in their order."""
        numbers = self.document.numbers if isinstance(self.document, Adjustable) else {}
        return {each.key: numbers[each.key] for each in self.searched}

    def tuned(self, values: Mapping[str, float]) -> ExternalDriver:
        """The same driver with other values of those parameters. Raises KeyError for an unknown parameter,
        ValueError for a value out of bounds."""
        assert isinstance(self.document, Adjustable), "the driver has no parameters to tune"
        return replace(self, document=self.document.tuned(values))

    def document_in(self, folder: Path) -> DriverDocument:
        """Its document, with paths relative to `folder` that lead to the same files."""
        assert self.document is not None, "a policy has no document"
        if not isinstance(self.document, WithFiles):
            return self.document
        moved: dict[str, Any] = {
            key: relative_to(folder, resolve_in(self.place, file)) for key, file in self.document.named_files.items()
        }
        moved["files"] = [relative_to(folder, resolve_in(self.place, each)) for each in self.document.files]
        if isinstance(self.document, Process):
            moved["folder"] = relative_to(folder, resolve_in(self.place, self.document.folder))
        return self.document.model_copy(update=moved)

    @property
    def in_words(self) -> str:
        """A description of the driver for reports."""
        return driver_in_words(self.document, self.written, self.package)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a check tells about the driver beside its name. Raises UsageError as `make` does."""
        if isinstance(self.document, Fmu):
            return tuple(filter(None, [unconnected_inputs(self.document, resolve_in(self.place, self.document.file))]))
        return ()

    def make(self, car: Car, sampled: bool) -> Driver:
        """Make the driver for a car. `sampled`: a policy samples its actions; other drivers ignore it.

        Raises UsageError if its files or parameters do not fit, DriverError if it can't be made or its files have
        changed.
        """
        changed = [file for file, known in self.files.items() if sha256_of(Path(file)) != known]
        if changed:
            raise DriverError(f"changed since the campaign was checked: {', '.join(changed)}")
        return make_driver(self.document, self.place, command=self.command, car=car, sampled=sampled)

    def try_out(
        self, car: Car, sampled: bool, games: int = 1, *, road: Callable[[], CartesianRoad] | None = None
    ) -> None:
        """Make the driver, reset this number of games and decide once in each, on the `road` if it is a planner. Raises
        UsageError if that fails."""
        try:
            driver = self.make(car, sampled)
            if driver.takes_over:
                driver.reset(np.arange(games))
                planner = planner_of(driver)
                if planner is not None and road is not None:
                    planner.see(np.arange(games), [CartesianView.at_start(road())] * games)
                driver.decide(np.arange(games), np.zeros((games, SIZE), dtype=np.float32), np.zeros((games, 2)))
        except UsageError:
            raise
        except Exception as error:  # a driver may raise any exception
            cause = str(error) if isinstance(error, DriverError) else f"{type(error).__name__}: {error}"
            beside = self.place / Path(self.written).name
            named = os.path.relpath(beside) if os.path.exists(beside) else self.written
            remedy = f"see harness check-driver {named}"
            raise UsageError.of(named, "", f"the test decision failed: {cause}", remedy) from error


def find_driver(written: str, file: Path, key: str, allow_code: bool) -> ExternalDriver:
    """The driver named `written` under `key` in `file`; paths are relative to that file's folder.

    Raises UsageError if it is not found or invalid, and if it runs code in files without permission (`allow_code`).
    """
    installed = installed_names()
    place = resolve(file, written) if written in installed else find_document(written, file.parent, "egos")
    if "/" in written and not os.path.exists(place):
        place = find_document(written, file.parent, "policies")
    if os.path.isdir(place):
        read_policy(place)
        return ExternalDriver(written=written, place=place, document=None, files=_hashed(policy_files(place)))
    if place.suffix.lower() != ".toml":
        _check_no_file(file, key, written, place)
    if os.path.exists(place):
        document = read_driver(place)
        if (runs := _RUNS_CODE.get(type(document))) and not allow_code:
            remedy = f"if you trust it, allow it on the command line: {ALLOW_CODE}"
            raise UsageError.of(place, "kind", f"this driver {runs}; a document can't give the permission", remedy)
        return _from_document(written, place, document)
    if "/" in written or place.suffix.lower() in {".toml", *ARCHIVES}:
        remedy = nearest_beside(place)
        if is_name(written, "policies"):
            remedy += f"; {_shipped_policies_as(written)}"
        raise UsageError.of(file, key, f"{written!r}: there is no such file or folder", remedy)
    names = [LEARNED, SUMO, *installed, *shipped_names("egos")]
    if written not in names:
        remedy = f"{nearest(written, names)}; or name a driver document or the folder of a policy"
        remedy += f"; {_shipped_policies_as(written)}"
        raise UsageError.of(file, key, f"there is no driver {written!r}", remedy)
    package = version_of(entry_point(written, file, key))
    document = Python(kind="python", entry_point=written)
    return ExternalDriver(written=written, place=place.parent, document=document, package=package)


def _check_no_file(file: Path, key: str, written: str, place: Path) -> None:
    """Raise UsageError if `place`, written as `written` under `key` in `file`, is a file that needs a document."""
    kind = _KIND_OF_SUFFIX.get(place.suffix.lower())
    if kind not in ("fmu", "onnx") and place.suffix.lower() != ".py":
        remedy = f'; or name a TOML document with kind = "{kind or "stable_baselines3"}", file = "{place.name}"'
        check_no_archive(file, key, written, place, remedy=remedy)
    if os.path.isfile(place):
        names = f'kind = "{kind}", file = "{place.name}"' if kind else f'kind = "process", command = ["./{place.name}"]'
        message = f"{written!r} is a file, and no driver document"
        raise UsageError.of(file, key, message, f"name a TOML document with {names} (docs/egos.md)")


def _shipped_policies_as(written: str) -> str:
    """A remedy: the shipped policies in the folder of a name, else one of every folder."""
    policies = shipped_policies()
    folder, _, _ = written.partition("/")
    in_folder = [name for name in policies if name.startswith(f"{folder}/")]
    one_of_each = {name.partition("/")[0]: name for name in reversed(policies)}
    if in_folder:
        return f"the shipped policies in {folder} are {', '.join(in_folder)}"
    return f"shipped policies have names such as {', '.join(sorted(one_of_each.values()))}"


def _from_document(written: str, place: Path, document: DriverDocument) -> ExternalDriver:
    folder = place.parent
    files = files_of(place, document) if isinstance(document, WithFiles) else []
    command: tuple[str, ...] = ()
    if isinstance(document, Process):
        runs_in = resolve_in(folder, document.folder)
        if not runs_in.is_dir():
            message = f"{document.folder!r}: there is no such folder"
            raise UsageError.of(place, "folder", message, nearest_beside(runs_in))
        program, *arguments = document.command
        command = (str(find_program(program, runs_in, place)), *arguments)
        named = [resolve_in(runs_in, each) for each in arguments if is_file(runs_in, each)]
        files = [Path(command[0]), *named, *files]
    package: Mapping[str, str] = {}
    if isinstance(document, Python):
        package = version_of(entry_point(document.entry_point, place, "entry_point"))
    return ExternalDriver(
        written=written, place=folder, document=document, command=command, files=_hashed(files), package=package
    )


def _hashed(files: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of each file, by path."""
    return {str(file): sha256_of(file) for file in files}
