"""Writing the schemas of the documents to files."""

from __future__ import annotations

from pathlib import Path

from harness.cli import wording
from harness.config.json_schema import DOCUMENTS, file_of, schema_text
from harness.errors import UsageError
from harness.files import write_atomically


def write_schemas(folder: Path, document: str | None = None) -> list[Path]:
    """Write one schema, or all, into a folder, and return the files. The folder is created if it does not exist.

    Raises UsageError if there is no such kind of document, or the path is not a folder.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError.of("--out", str(folder), *wording.NOT_A_FOLDER)
    texts = {folder / file_of(each): schema_text(each) for each in ([document] if document is not None else DOCUMENTS)}
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        write_atomically(file, text.encode())
    return list(texts)
