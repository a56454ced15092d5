"""The files of driver documents: their paths, and their hashes."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

from harness.config.campaign import resolve
from harness.config.driver import Onnx, Process, Python, WithFiles
from harness.config.toml_reading import nearest_beside
from harness.drivers.onnx_network import external_files
from harness.errors import UsageError
from harness.files import digest_of_file


def find_program(name: str, folder: Path, document: Path) -> Path:
    """The file of a program: relative to the folder it runs in if its name contains a `/`, otherwise on PATH."""
    # Links are not resolved: the python of a virtual environment is a link, and its path selects the packages.
    found = shutil.which(os.path.abspath(folder / name) if "/" in name else name)
    if found is None:
        where = f"in {folder}" if "/" in name else "on PATH"
        message = f"there is no executable program {name!r} {where}"
        raise UsageError.of(document, "command", message, "build or install it, or correct its name or permissions")
    return Path(found)


def files_of(place: Path, document: WithFiles) -> list[Path]:
    """The files that a document at `place` names, each once: under a key of its own, under `files`, and as parameters
    that are paths of files, and those that an ONNX file names. Raises UsageError for a missing one."""
    folder = place.parent
    named = [*document.named_files.items(), *(("files", each) for each in document.files)]
    for key, file in named:
        if not is_file(folder, file):
            message = f"{file!r}: there is no such file"
            raise UsageError.of(place, key, message, nearest_beside(resolve_in(folder, file)))
    found = [resolve_in(folder, file) for _, file in named]
    if isinstance(document, Onnx):
        found += external_files(document, resolve_in(folder, document.file))
    if isinstance(document, Process | Python):
        texts = [each for each in document.parameters.values() if isinstance(each, str) and each]
        # A package reads them relative to the working folder, a program relative to its own.
        places = [resolve_in(folder, document.folder) if isinstance(document, Process) else Path.cwd(), folder]
        found += [resolve_in(each, text) for text in texts for each in places if is_file(each, text)]
    return list(dict.fromkeys(found))


def resolve_in(folder: Path, written: str) -> Path:
    """A path in a driver document, which is relative to the document's folder."""
    return resolve(folder / "document", written)


def relative_to(folder: Path, file: Path) -> str:
    """A file's path relative to a folder, in the notation of documents."""
    return Path(os.path.relpath(file, os.path.realpath(folder))).as_posix()


def is_file(folder: Path, written: str) -> bool:
    """Whether a path in a driver document leads to a file."""
    try:
        return resolve_in(folder, written).is_file()
    except (OSError, ValueError):
        return False


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content. Raises UsageError if it can't be read or is larger than `MOST_HASHED_BYTES`."""
    try:
        return digest_of_file(path)
    except OSError as error:
        if error.errno == errno.EFBIG:
            raise UsageError.of(path, "", str(error.strerror), "name a smaller file") from None
        raise UsageError.of(path, "", f"cannot be read: {error}", "correct its permissions") from None
