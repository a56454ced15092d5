"""The documents that come with the harness: scenes, personas, egos, policies and campaigns, found by their names.

An installed package has them in `harness/shipped/`, a checkout at its top.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Literal

from harness.errors import UsageError, name_like

Kind = Literal["networks", "personas", "egos", "perception", "policies", "campaigns"]
"""The folders of documents."""

PACKAGE = Path(__file__).resolve().parent

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_FOLDERS: tuple[Kind, ...] = ("networks", "policies")  # a document of these is a folder, of the others a TOML file
_ONE_OF: dict[Kind, str] = {
    "networks": "scene",
    "personas": "persona",
    "egos": "ego",
    "perception": "perception document",
    "policies": "folder of policies",
    "campaigns": "campaign",
}


def shipped(kind: Kind) -> Path:
    """The folder of the shipped documents of a kind."""
    packaged = PACKAGE / "shipped"
    return (packaged if packaged.is_dir() else PACKAGE.parent) / kind


def shipped_names(kind: Kind) -> list[str]:
    """The names of the shipped documents of a kind."""
    folder = shipped(kind)
    if not folder.is_dir():
        return []
    found = (each for each in folder.iterdir() if each.is_dir() == (kind in _FOLDERS))
    return sorted(each.stem for each in found if kind in _FOLDERS or each.suffix == ".toml")


def shipped_policies() -> list[str]:
    """The names of the shipped policies, such as `paper_merge/naive-seed11`."""
    folder = shipped("policies")
    return sorted(each.parent.relative_to(folder).as_posix() for each in folder.glob("*/*/policy.json"))


def is_name(written: str, kind: Kind) -> bool:
    """Whether a document is named as in `scene = "merge"` or `driver = "paper_merge/naive-seed11"`, not by a path."""
    parts = written.split("/", 1) if kind == "policies" else [written]  # a folder of policies, and a policy in it
    return all(_NAME.fullmatch(each) for each in parts)


def find_document(written: str, folder: Path, kind: Kind) -> Path:
    """The absolute path of a document that a file in `folder` names; it may not exist.

    A path is relative to the folder; it may be one that no system accepts. A name, such as `merge`, is that of a
    document in the folder, in its subfolder of the kind, or of a shipped document: the first that exists.
    """
    beside = Path(os.path.realpath(folder / written))
    if not is_name(written, kind) or os.path.exists(beside):
        return beside
    file = written if kind in _FOLDERS else f"{written}.toml"
    for place in (folder, folder / kind, shipped(kind)):
        if os.path.exists(place / file):
            return Path(os.path.realpath(place / file))
    return beside


def named_document(written: str, kind: Kind, file: Path | None = None, key: str = "") -> Path:
    """The absolute path of a document that Python code, or a file under a key, names by a path or a name; of a path, it
    may not exist.

    Raises UsageError if it is a name of no document.
    """
    folder = Path() if file is None else file.parent
    found = find_document(written, folder, kind)
    if is_name(written, kind) and not os.path.exists(found):
        raise UsageError.of(file or written, key, *missing_document(written, folder, kind))
    return found


def document_at(path: Path, kind: Kind) -> Path:
    """A path of a command line as it is, or the path of the document of that name where there is no such file.

    Raises UsageError if it is a name of no document.
    """
    return path if os.path.exists(path) or not is_name(str(path), kind) else named_document(str(path), kind)


def missing_document(written: str, folder: Path, kind: Kind) -> tuple[str, str]:
    """Message and remedy for a name of which there is no document."""
    names = {each.stem for place in (folder, folder / kind) if place.is_dir() for each in place.iterdir()}
    close = name_like(written, names | set(shipped_names(kind)))
    shown = f"did you mean {close!r}?" if close else f"shipped are {', '.join(shipped_names(kind))};"
    return f"there is no {_ONE_OF[kind]} {written!r}", f"{shown} a path is relative to {folder.absolute()}"
