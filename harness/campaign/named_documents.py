"""The documents that a campaign names: they are found, and read even where the rest of the campaign is wrong."""

from __future__ import annotations

import os
from pathlib import Path

from pydantic import ConfigDict

from harness.config.campaign import LEARNED, DocumentPath, Ego
from harness.config.persona import Persona
from harness.config.toml_reading import Document, read_document
from harness.errors import UsageError
from harness.shipped_documents import Kind, find_document, is_name, missing_document


class _NamedByEgo(Document):
    model_config = ConfigDict(extra="ignore")
    driver: DocumentPath = LEARNED
    persona: DocumentPath = Ego().persona


class NamedDocuments(Document):
    """The documents that a campaign names: they are checked even where the rest of it is wrong."""

    model_config = ConfigDict(extra="ignore")
    scene: DocumentPath
    personas: list[DocumentPath]
    policies: DocumentPath | None = None
    ego: _NamedByEgo = _NamedByEgo()


def read_names(file: Path) -> NamedDocuments | None:
    """What a campaign names; None if not even that can be read."""
    try:
        return read_document(file, NamedDocuments)
    except UsageError:
        return None


def find_named(file: Path, key: str, written: str, kind: Kind) -> Path:
    """A document that a campaign names. Raises UsageError if a name is that of no document."""
    found = find_document(written, file.parent, kind)
    if is_name(written) and not os.path.exists(found):
        raise UsageError.of(file, key, *missing_document(written, file.parent, kind))
    return found


def read_named_persona(file: Path, key: str, written: str) -> tuple[Path, Persona]:
    """The file of a persona that a campaign names, and the persona. Raises UsageError if it is missing or wrong."""
    path = find_named(file, key, written, "personas")
    return path, read_document(path, Persona)
