"""Writing a document as a TOML file."""

from __future__ import annotations

from collections.abc import Sequence

import tomli_w

from harness.config.toml_reading import Document
from harness.errors import plain


def toml_of(document: Document, comments: Sequence[str] = ()) -> str:
    """A document as TOML text that reads back as an equal document, below the comments, one line each."""
    lines = [f"# {plain(' '.join(comment.split()))}\n" for comment in comments]
    return "".join(lines) + tomli_w.dumps(document.model_dump(exclude_none=True))
