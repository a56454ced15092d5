"""External drivers: drivers that a campaign does not train. They are found, hashed, and made for a car.

| in the campaign | is |
| --- | --- |
| `driver = "policies/naive-seed1"` | the folder of a policy |
| `driver = "egos/adas.toml"` | a driver document, see `harness.config.driver` |
| `driver = "adas"` | a shipped driver document |
| `driver = "my_driver"` | an installed package's entry point, see `harness.drivers.entry_points` |

Programs, FMUs and files of Stable-Baselines3 are code in files. Campaigns are documents that people exchange: neither a
campaign nor a driver document may start such code. It runs only with the permission of the user, given on the command
line. An installed package needs no permission, because the user has installed it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.config.campaign import LEARNED, SUMO, resolve
from harness.config.driver import DriverDocument, Fmu, Process, Python, StableBaselines3, Sumo, read_driver
from harness.config.rule_driver import Rules
from harness.config.toml_reading import nearest
from harness.config.tunable import Adjustable, Tunable
from harness.drivers.car import Car
from harness.drivers.driver_files import find_program, is_file, names_beside, relative_to, resolve_in, sha256_of
from harness.drivers.entry_points import entry_point, installed_driver, installed_names, version_of
from harness.drivers.fmu import fmu_driver
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import check_no_archive, policy_files, read_policy
from harness.drivers.process import ProcessDriver
from harness.drivers.protocol import Driver
from harness.drivers.rules import RulesDriver
from harness.drivers.sumo import SumoDriver
from harness.errors import DriverError, UsageError
from harness.game.observation_layout import SIZE
from harness.shipped_documents import find_document, shipped_names

ALLOW_CODE = "--allow-code"
_RUNS_CODE = {
    Process: "starts a program",
    Fmu: "runs an FMU, which is a program",
    StableBaselines3: "reads a file of Stable-Baselines3, which may contain pickles: reading them can run any code",
}


@dataclass(frozen=True, kw_only=True)
class ExternalDriver:
    """A driver that was found, with everything its decisions depend on. It can be pickled for another process."""

    written: str
    """The name of the driver in the campaign."""
    place: Path
    """The folder of a policy, or the folder that paths in the document are relative to."""
    document: DriverDocument | None
    """None: a policy's folder."""
    command: tuple[str, ...]
    """Of a program: its path and arguments. Empty for other kinds."""
    files: Mapping[str, str]
    """SHA-256 of each file that the driver depends on, by path."""
    package: Mapping[str, str]
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
        document = self.document.model_dump(
            mode="json", exclude={"tunable"}
        )  # bounds of a search, without effect on decisions
        if isinstance(self.document, Process):  # the files are hashed, so their place has no effect
            del document["folder"]
            if not self.document.parameters:
                del document["parameters"]
        return {"document": document, "files": list(self.files.values()), "package": dict(self.package)}

    @property
    def recorded(self) -> dict[str, Any]:
        """The driver's entry in a manifest."""
        return {
            "driver": self.written,
            "kind": self.kind,
            "in_words": self.in_words,
            "document": self.document.model_dump(mode="json") if self.document is not None else None,
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
        match self.document:
            case Process(folder=written):
                return self.document.model_copy(update={"folder": relative_to(folder, resolve_in(self.place, written))})
            case Fmu(file=file) | StableBaselines3(file=file):
                return self.document.model_copy(update={"file": relative_to(folder, resolve_in(self.place, file))})
        return self.document

    @property
    def in_words(self) -> str:
        """A description of the driver for reports."""
        match self.document:
            case None:
                return f"the policy {self.written}"
            case Sumo(vehicle_type=name):
                return f"SUMO's own models of vehicle type {name} ({self.written})"
            case Rules(name=name):
                return f"the rules {name} ({self.written})"
            case Process(command=command):
                return f"the program {' '.join(command)} ({self.written})"
            case Fmu(file=file):
                return f"the FMU {file} ({self.written})"
            case StableBaselines3(file=file, algorithm=algorithm):
                return f"the {algorithm} policy {file} of Stable-Baselines3 ({self.written})"
            case Python(entry_point=name):
                return f"{name} of the package {self.package['package']} {self.package['version']}"

    def make(self, car: Car, sampled: bool) -> Driver:
        """Make the driver for a car. `sampled`: a policy samples its actions; other drivers ignore it.

        Raises UsageError if its files or parameters do not fit, DriverError if it can't be made or its files have
        changed.
        """
        changed = [file for file, known in self.files.items() if sha256_of(Path(file)) != known]
        if changed:
            raise DriverError(f"changed since the campaign was checked: {', '.join(changed)}")
        match self.document:
            case None:
                return LearnedDriver(read_policy(self.place), sampled)
            case Sumo():
                return SumoDriver()
            case Rules():
                return RulesDriver(self.document, car)
            case Process(folder=folder, units=units):
                return ProcessDriver(
                    self.command,
                    resolve_in(self.place, folder),
                    car,
                    units=units,
                    deadline_s=self.document.deadline_s,
                    start_deadline_s=self.document.start_deadline_s,
                    parameters=self.document.parameters,
                )
            case Fmu(file=file):
                return fmu_driver(self.document, resolve_in(self.place, file), car)
            case StableBaselines3(file=file):
                from harness.drivers.sb3_policy import Sb3Driver  # torch is slow to import

                return Sb3Driver(self.document, resolve_in(self.place, file), sampled)
            case Python(entry_point=name, parameters=parameters):
                return installed_driver(entry_point(name, self.written, "entry_point"), car, parameters)

    def try_out(self, car: Car, sampled: bool, games: int = 1) -> None:
        """Make the driver, reset this number of games and decide once in each. Raises UsageError if that fails."""
        try:
            driver = self.make(car, sampled)
            if driver.takes_over:
                driver.reset(np.arange(games))
                driver.decide(np.arange(games), np.zeros((games, SIZE), dtype=np.float32), np.zeros((games, 2)))
        except UsageError:
            raise
        except Exception as error:  # a driver may raise any exception
            cause = str(error) if isinstance(error, DriverError) else f"{type(error).__name__}: {error}"
            remedy = f"see harness check-driver {self.written}"
            raise UsageError.of(self.written, "", f"the test decision failed: {cause}", remedy) from error


def find_driver(written: str, file: Path, key: str, allow_code: bool) -> ExternalDriver:
    """The driver named `written` under `key` in `file`; paths are relative to that file's folder.

    Raises UsageError if it is not found or invalid, and if it runs code in files without permission (`allow_code`).
    """
    place = _place(file, written)
    if os.path.isdir(place):
        read_policy(place)
        return _external(written, place, None, files=policy_files(place))
    if place.suffix.lower() != ".toml":
        kind = "fmu" if place.suffix.lower() == ".fmu" else "stable_baselines3"
        remedy = f'; or name a TOML document with kind = "{kind}", file = "{place.name}"'
        check_no_archive(file, key, written, place, remedy=remedy)
    if not os.path.exists(place):
        if written.endswith(".toml") or "/" in written:
            remedy = (
                nearest(place.name, names_beside(place)) if os.path.isdir(place.parent) else f"no folder {place.parent}"
            )
            raise UsageError.of(file, key, f"{written!r}: there is no such file or folder", remedy)
        names = [LEARNED, SUMO, *installed_names(), *shipped_names("egos")]
        if written not in names:
            remedy = nearest(written, names) + "; or name a driver document or the folder of a policy"
            raise UsageError.of(file, key, f"there is no driver {written!r}", remedy)
        document: DriverDocument = Python(kind="python", entry_point=written)
        package = version_of(entry_point(written, file, key))
        return _external(written, place.parent, document, package=package)
    document = read_driver(place)
    if (runs := _RUNS_CODE.get(type(document))) and not allow_code:
        remedy = f"if you trust it, allow it on the command line: {ALLOW_CODE}"
        raise UsageError.of(place, "kind", f"this driver {runs}; a document can't give the permission", remedy)
    return _from_document(written, place, document)


def _place(file: Path, written: str) -> Path:
    """Where a driver would be that a file names: beside the file, or shipped, unless a package provides one."""
    beside = resolve(file, written)
    return beside if written in installed_names() else find_document(written, file.parent, "egos")


def _from_document(written: str, place: Path, document: DriverDocument) -> ExternalDriver:
    folder = place.parent
    match document:
        case Process(command=command, files=files):
            runs_in = resolve_in(folder, document.folder)
            if not runs_in.is_dir():
                remedy = nearest(runs_in.name, names_beside(runs_in))
                raise UsageError.of(place, "folder", f"{document.folder!r}: there is no such folder", remedy)
            program = find_program(command[0], runs_in, place)
            depends_on = [*(each for each in command[1:] if is_file(runs_in, each)), *files]
            missing = [each for each in files if not is_file(runs_in, each)]
            if missing:
                remedy = nearest(Path(missing[0]).name, names_beside(resolve_in(runs_in, missing[0])))
                raise UsageError.of(place, "files", f"{missing[0]!r}: there is no such file", remedy)
            paths = [program, *(resolve_in(runs_in, each) for each in depends_on)]
            return _external(written, folder, document, files=paths, command=(str(program), *command[1:]))
        case Fmu(file=file) | StableBaselines3(file=file):
            if not is_file(folder, file):
                remedy = nearest(Path(file).name, names_beside(resolve_in(folder, file)))
                raise UsageError.of(place, "file", f"{file!r}: there is no such file", remedy)
            return _external(written, folder, document, files=[resolve_in(folder, file)])
        case Python(entry_point=name):
            package = version_of(entry_point(name, place, "entry_point"))
            return _external(written, folder, document, package=package)
        case _:
            return _external(written, folder, document)


def _external(
    written: str,
    place: Path,
    document: DriverDocument | None,
    *,
    files: Iterable[Path] = (),
    package: Mapping[str, str] | None = None,
    command: tuple[str, ...] = (),
) -> ExternalDriver:
    return ExternalDriver(
        written=written,
        place=place,
        document=document,
        command=command,
        files={str(file): sha256_of(file) for file in files},
        package=package or {},
    )
