"""A document as TOML text that reads back as the same document."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from harness.config.toml_reading import Document
from harness.errors import plain

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_of(document: Document, said: Sequence[str] = ()) -> str:
    """A document as TOML: its plain keys, then its tables. What is `said` stands above it, in comments."""
    content = {key: value for key, value in document.model_dump().items() if value is not None}
    lines = [f"# {plain(' '.join(line.split()))}" for line in said]
    lines += [f"{_key(key)} = {_value(value)}" for key, value in content.items() if not isinstance(value, dict)]
    for name, table in content.items():
        if isinstance(table, dict):
            lines += ["", f"[{_key(name)}]", *(f"{_key(key)} = {_value(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value)  # other numbers and truth values are written alike in JSON and TOML


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
