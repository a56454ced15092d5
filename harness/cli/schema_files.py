"""The schemas of the documents as files: those that the project publishes, and a user's own."""

from __future__ import annotations

from pathlib import Path

from harness.config.json_schema import DOCUMENTS, file_of, schema_text
from harness.errors import UsageError
from harness.files import write_atomically


def write_schemas(folder: Path, document: str | None = None) -> list[Path]:
    """Write one schema, or all, into a folder, which is made if it isn't there; the files written.

    Raises UsageError when there is no such kind of document, or the folder is none.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError.of("--out", str(folder), "is not a folder", "name a folder")
    texts = {folder / file_of(each): schema_text(each) for each in ([document] if document is not None else DOCUMENTS)}
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        write_atomically(file, text.encode())
    return list(texts)
