"""Reading a TOML document into a pydantic model; every mistake in it becomes a `Problem`, all at once."""

from __future__ import annotations

import difflib
import json
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from harness.errors import Problem, UsageError
from harness.files import content_of

if sys.version_info >= (3, 11):
    import tomllib
else:  # pragma: no cover
    import tomli as tomllib


class Document(BaseModel):
    """A frozen record that knows all its keys: an unknown one is an error."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


class Mistakes(ValueError):
    """Several mistakes that a record's validator found: key below the record, message and remedy of each."""

    def __init__(self, found: list[tuple[str, str, str]]) -> None:
        self.found = found
        super().__init__("; ".join(f"{key}: {message}" for key, message, _ in found))


_MOST_BYTES, _MOST_MISTAKES = 1_000_000, 100
_NAMES_SHOWN, _COMPARED = 40, 200
_QUOTED = re.compile(r""""[^"\n]*"|'[^'\n]*'""")
_ENDLESS_KEY = re.compile(r"(?<![\w.-])(?:[\w-]+[ \t]*\.[ \t]*){50}")
NUMBER, TABLE = "<number>", "<table>"  # tags of what may be either; not part of any key

D = TypeVar("D", bound=Document)


def read_document(path: Path, model: type[D]) -> D:
    """Read a TOML file into a model. Raises UsageError naming file, key and remedy for each mistake in it."""
    remedy = "a UTF-8 TOML file is needed"
    try:
        text = content_of(path, _MOST_BYTES).decode("utf-8")
    except FileNotFoundError:
        raise UsageError.of(path, "", "there is no such file", _similar_file(path)) from None
    except OSError as error:
        raise UsageError.of(path, "", f"cannot be read: {error.strerror}", remedy) from None
    except UnicodeDecodeError as error:
        raise UsageError.of(path, "", f"cannot be read: {error}", remedy) from None
    if text.startswith("\ufeff"):
        raise UsageError.of(path, "", "begins with a byte order mark", "save it as UTF-8 without one")
    if _ENDLESS_KEY.search(_QUOTED.sub("q", text)):  # it would be read for minutes
        raise UsageError.of(path, "", "has tables in tables without end", "no key has more than a few dots")
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: besides bad TOML, a number of thousands of digits
        raise UsageError.of(path, "", f"is not valid TOML: {error}", "mend it at the line named") from None
    return _validated(path, table, model)


def _validated(path: Path, table: dict[str, Any], model: type[D]) -> D:
    try:
        return model.model_validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        first = error.errors(include_url=False)[:_MOST_MISTAKES]
        raise UsageError(found for each in first for found in _problems(path, model, each)) from None
    except RecursionError:
        raise UsageError.of(path, "", "has tables in tables without end", "no key has more than a few dots") from None
    except ValueError as error:  # NaN and infinity have no place in JSON
        raise UsageError.of(path, "", str(error), "numbers must be finite") from None


def nearest(word: str, words: Iterable[str]) -> str:
    """A remedy naming the valid word nearest to a misspelt one, or all of them, if they are not too many."""
    words = sorted(words)
    close = difflib.get_close_matches(word[:_COMPARED], words, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]!r}?"
    more = f" and {len(words) - _NAMES_SHOWN} more" if len(words) > _NAMES_SHOWN else ""
    return f"valid: {', '.join(words[:_NAMES_SHOWN])}{more}"


def _problems(path: Path, model: type[BaseModel], error: Any) -> Iterator[Problem]:
    location = [part for part in error["loc"] if part not in ("function-after", "[key]", NUMBER, TABLE)]
    key = ".".join(f"[{part}]" if isinstance(part, int) else str(part) for part in location).replace(".[", "[")
    cause = error.get("ctx", {}).get("error")
    if error["type"] == "extra_forbidden":
        known = nearest(str(location[-1]), _keys_at(model, location[:-1]))
        yield Problem(str(path), key, "unknown key", known)
    elif error["type"] == "missing":
        yield Problem(str(path), key, "is missing", "add it")
    elif isinstance(cause, Mistakes):
        for below, message, remedy in cause.found:
            yield Problem(str(path), f"{key}.{below}" if key else below, message, remedy)
    elif cause is not None:
        yield Problem(str(path), key, str(cause))
    else:
        yield Problem(str(path), key, f"{_shown(error['input'])} is not possible", _lower(error["msg"]))


def _shown(given: Any) -> str:
    if isinstance(given, dict | list):
        return "this table" if isinstance(given, dict) else "this list"
    return repr(given)[:60]


def _lower(message: str) -> str:
    return message[0].lower() + message[1:]


def _keys_at(model: type[BaseModel], location: list[Any]) -> list[str]:
    here: Any = model
    for part in location:
        if isinstance(part, int) or not hasattr(here, "model_fields"):
            continue
        field = here.model_fields.get(part)
        here = _model_in(field.annotation) if field else here  # else: the key of a table whose keys are free
    return list(here.model_fields) if hasattr(here, "model_fields") else []


def _model_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for each in get_args(annotation) if (found := _model_in(each))), None)


def _similar_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}"
    return nearest(path.name, [each.name for each in path.parent.iterdir()] or ["(an empty folder)"])
