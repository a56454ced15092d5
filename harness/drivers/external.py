"""A driver that a campaign is given rather than trains: found, hashed, and made for a car.

| in the campaign | is |
| --- | --- |
| `driver = "policies/naive-seed1"` | the folder of a policy |
| `driver = "egos/adas.toml"` | a driver document, see `harness.config.driver` |
| `driver = "my_driver"` | an installed package's entry point, see `harness.drivers.entry_points` |

Programs, FMUs and files of Stable-Baselines3 are code that comes as a file. A campaign is a document, which people
send each other: it must not be able to start such code by itself, nor may a document that it names. Only who runs
the command can allow it. An installed package was installed by that very person: it needs no further leave.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping
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
from harness.drivers.entry_points import entry_point, installed_driver, installed_names, version_of
from harness.drivers.fmu import fmu_driver
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import check_no_archive, policy_files, read_policy
from harness.drivers.process import ProcessDriver
from harness.drivers.protocol import Driver
from harness.drivers.rules import RulesDriver
from harness.drivers.sumo import SumoDriver
from harness.errors import DriverError, UsageError
from harness.game.observation import SIZE

ALLOW_CODE = "--allow-code"
_RUNS = {
    Process: "starts a program",
    Fmu: "runs an FMU, which is a program",
    StableBaselines3: "reads a file of Stable-Baselines3, which may hold pickles: they run whatever code is in them",
}


@dataclass(frozen=True)
class ExternalDriver:
    """A driver that was found, with all that its decisions rest on. Small enough to be sent to another process."""

    written: str
    """As the campaign names it."""
    place: Path
    """The folder of a policy, or the folder that paths in the document are relative to."""
    document: DriverDocument | None
    """None: a policy's folder."""
    command: tuple[str, ...]
    """Of a program: with its place."""
    files: Mapping[str, str]
    """SHA-256 of each file it rests on, by its path."""
    package: Mapping[str, str]
    """Of an installed driver: package, version, entry point, and a hash of the code."""

    @property
    def kind(self) -> str:
        return "policy" if self.document is None else self.document.kind

    @property
    def vehicle_type(self) -> str | None:
        """The vehicle type that its car is of, where that is not the scene's."""
        return self.document.vehicle_type if isinstance(self.document, Sumo) else None

    @property
    def identity(self) -> Any:
        """What its numbers depend on: hashed into the keys of stages."""
        if self.document is None:
            return self.files[str(policy_files(self.place)[1])]
        document = self.document.model_dump(mode="json", exclude={"tunable"})  # what may be is not what is
        if isinstance(self.document, Process):  # its files are hashed, wherever they are
            del document["folder"]
            if not self.document.parameters:
                del document["parameters"]
        return {"document": document, "files": list(self.files.values()), "package": dict(self.package)}

    @property
    def recorded(self) -> dict[str, Any]:
        """What a manifest says of it."""
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
        """The parameters of it that may be searched for a better driver. Nothing: it has nothing to tune."""
        return self.document.searched if isinstance(self.document, Adjustable) else ()

    @property
    def numbers(self) -> dict[str, float]:
        """The values that those parameters have, in their order."""
        numbers = self.document.numbers if isinstance(self.document, Adjustable) else {}
        return {each.key: numbers[each.key] for each in self.searched}

    def tuned(self, values: Mapping[str, float]) -> ExternalDriver:
        """The same driver with other values of such parameters. Raises KeyError and ValueError as its document does."""
        assert isinstance(self.document, Adjustable), "a driver that has nothing to tune"
        return replace(self, document=self.document.tuned(values))

    def document_in(self, folder: Path) -> DriverDocument:
        """Its document as it has to be in a folder, so that the paths in it lead to the same files."""
        assert self.document is not None, "a policy's folder is no document"
        match self.document:
            case Process(folder=written):
                return self.document.model_copy(update={"folder": _path_from(folder, resolve_in(self.place, written))})
            case Fmu(file=file) | StableBaselines3(file=file):
                return self.document.model_copy(update={"file": _path_from(folder, resolve_in(self.place, file))})
        return self.document

    @property
    def in_words(self) -> str:
        """Which driver this is, for a reader of a report."""
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
        """The driver, for a car. A policy of ours or of Stable-Baselines3 varies as it does where it is `sampled`.

        Raises UsageError where what it is made of doesn't fit, DriverError where it can't be made.
        """
        changed = [file for file, known in self.files.items() if _hash(Path(file)) != known]
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
                deadlines = self.document.deadline_s, self.document.start_deadline_s
                place, told = resolve_in(self.place, folder), self.document.parameters
                return ProcessDriver(self.command, place, car, units, *deadlines, parameters=told)
            case Fmu(file=file):
                return fmu_driver(self.document, resolve_in(self.place, file), car)
            case StableBaselines3(file=file):
                from harness.drivers.sb3_policy import Sb3Driver  # torch is slow to import

                return Sb3Driver(self.document, resolve_in(self.place, file), sampled)
            case Python(entry_point=name, parameters=parameters):
                return installed_driver(entry_point(name, self.written, "entry_point"), car, parameters)

    def try_out(self, car: Car, sampled: bool, games: int = 1) -> None:
        """Make it, begin so many games at once and decide once. Raises UsageError where that fails."""
        try:
            driver = self.make(car, sampled)
            if driver.takes_over:
                driver.reset(np.arange(games))
                driver.decide(np.arange(games), np.zeros((games, SIZE), dtype=np.float32), np.zeros((games, 2)))
        except UsageError:
            raise
        except Exception as error:  # a driver may raise what it likes
            what = str(error) if isinstance(error, DriverError) else f"{type(error).__name__}: {error}"
            remedy = f"harness check-driver {self.written} says more"
            raise UsageError.of(self.written, "", f"could not drive when it was tried: {what}", remedy) from error


def find_driver(written: str, file: Path, key: str, allow_code: bool) -> ExternalDriver:
    """The driver that is named so under `key` in `file`; paths are relative to that file's folder.

    Raises UsageError with what is wrong with it, or where it runs code that comes as a file without leave.
    """
    place = resolve(file, written)
    if os.path.isdir(place):
        read_policy(place)
        return _given(written, place, None, policy_files(place))
    if place.suffix.lower() != ".toml":
        kind = "fmu" if place.suffix.lower() == ".fmu" else "stable_baselines3"
        document_of = f'; or name a TOML document with kind = "{kind}", file = "{place.name}"'
        check_no_archive(file, key, written, place, document_of)
    if not os.path.exists(place):
        if written.endswith(".toml") or "/" in written:
            remedy = nearest(place.name, _beside(place)) if os.path.isdir(place.parent) else f"no folder {place.parent}"
            raise UsageError.of(file, key, f"{written!r}: there is no such file or folder", remedy)
        names = [LEARNED, SUMO, *installed_names()]
        if written not in names:
            remedy = nearest(written, names) + "; or name a driver document or the folder of a policy"
            raise UsageError.of(file, key, f"there is no driver {written!r}", remedy)
        document: DriverDocument = Python(kind="python", entry_point=written)
        return _given(written, place.parent, document, (), version_of(entry_point(written, file, key)))
    document = read_driver(place)
    if (runs := _RUNS.get(type(document))) and not allow_code:
        remedy = f"if you trust it, say so on the command line: {ALLOW_CODE}"
        raise UsageError.of(place, "kind", f"this driver {runs}; a document can't give itself leave to", remedy)
    return _opened(written, place, document)


def _opened(written: str, place: Path, document: DriverDocument) -> ExternalDriver:
    folder = place.parent
    match document:
        case Process(command=command, files=files):
            runs_in = resolve_in(folder, document.folder)
            if not runs_in.is_dir():
                remedy = nearest(runs_in.name, _beside(runs_in))
                raise UsageError.of(place, "folder", f"{document.folder!r}: there is no such folder", remedy)
            program = _program(command[0], runs_in, place)
            rests_on = [*(each for each in command[1:] if _is_file(runs_in, each)), *files]
            missing = [each for each in files if not _is_file(runs_in, each)]
            if missing:
                remedy = nearest(Path(missing[0]).name, _beside(resolve_in(runs_in, missing[0])))
                raise UsageError.of(place, "files", f"{missing[0]!r}: there is no such file", remedy)
            paths = [program, *(resolve_in(runs_in, each) for each in rests_on)]
            return _given(written, folder, document, paths, command=(str(program), *command[1:]))
        case Fmu(file=file) | StableBaselines3(file=file):
            if not _is_file(folder, file):
                remedy = nearest(Path(file).name, _beside(resolve_in(folder, file)))
                raise UsageError.of(place, "file", f"{file!r}: there is no such file", remedy)
            return _given(written, folder, document, [resolve_in(folder, file)])
        case Python(entry_point=name):
            point = entry_point(name, place, "entry_point")
            return _given(written, folder, document, (), version_of(point))
        case _:
            return _given(written, folder, document, ())


def _given(
    written: str,
    place: Path,
    document: DriverDocument | None,
    files: Any,
    package: Mapping[str, str] | None = None,
    command: tuple[str, ...] = (),
) -> ExternalDriver:
    return ExternalDriver(written, place, document, command, {str(file): _hash(file) for file in files}, package or {})


def _program(name: str, folder: Path, document: Path) -> Path:
    """The file of a program: from the folder it runs in where its name has a `/`, otherwise on PATH."""
    # not resolved: a virtual environment's python is a link, and knows by its place which packages it has
    found = shutil.which(os.path.abspath(folder / name) if "/" in name else name)
    if found is None:
        where = "here" if "/" in name else "on PATH"
        message = f"there is no program {name!r} {where} that can be run"
        raise UsageError.of(document, "command", message, "build or install it, or mend its name and permissions")
    return Path(found)


def resolve_in(folder: Path, written: str) -> Path:
    """A path in a driver document is relative to the document's own folder."""
    return resolve(folder / "document", written)


def _path_from(folder: Path, file: Path) -> str:
    return Path(os.path.relpath(file, os.path.realpath(folder))).as_posix()


def _is_file(folder: Path, written: str) -> bool:
    try:
        return resolve_in(folder, written).is_file()
    except (OSError, ValueError):
        return False


def _beside(path: Path) -> list[str]:
    names = [each.name for each in path.parent.iterdir()] if path.parent.is_dir() else []
    return names or ["(there is nothing in its folder)"]


def _hash(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError.of(path, "", f"cannot be read: {error}", "mend its permissions") from None
