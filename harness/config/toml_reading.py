"""Documents: pydantic models that are read from TOML files. All mistakes in a file are reported together, each as a
`Problem`."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import tomli_w
from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError
from typing_extensions import Self

from harness.errors import Problem, UsageError, name_like, plain
from harness.files import content_of

if sys.version_info >= (3, 11):
    import tomllib
else:  # pragma: no cover
    import tomli as tomllib

parse_toml = tomllib.loads
"""The table in a TOML text, whichever Python this is. Raises tomllib.TOMLDecodeError."""


class Document(BaseModel):
    """A frozen record that knows all its keys: an unknown one is an error."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    @classmethod
    def named_location(cls, location: list[Any]) -> list[Any]:
        """A location in the document, keys and places in lists, as messages name it."""
        return location

    @classmethod
    def from_record(cls, record: object) -> Self:
        """A document from its JSON values, as a run folder records it. Raises pydantic's ValidationError."""
        return cls.model_validate(record, strict=False)

    def record(self) -> dict[str, Any]:
        """The document as JSON values, every key with its value: what a run folder records, and what is hashed."""
        return self.model_dump(mode="json")

    def toml(self, *comments: str) -> str:
        """The document as TOML text that reads back as an equal document, below the comments, one line each."""
        lines = [f"# {plain(' '.join(comment.split()))}\n" for comment in comments]
        return "".join(lines) + tomli_w.dumps(self.model_dump(exclude_none=True))


class Excerpt(Document):
    """Some keys of a document; others are ignored."""

    model_config = ConfigDict(extra="ignore")


def ordered(interval: tuple[float, float]) -> tuple[float, float]:
    """A range, if its lower end is first."""
    if interval[0] > interval[1]:
        raise ValueError(f"the interval [{interval[0]:g}, {interval[1]:g}] is empty: write the lower end first")
    return interval


Interval = Annotated[tuple[float, float], AfterValidator(ordered)]
"""A range, the lower end first."""


class Mistakes(ValueError):
    """Several mistakes found by the validator of a record: key below the record, message and remedy of each."""

    def __init__(self, mistakes: list[tuple[str, str, str]]) -> None:
        self.mistakes = mistakes
        super().__init__("; ".join(f"{key}: {message}" for key, message, _ in mistakes))


MOST_BYTES = 1_000_000
"""Of a document."""
_MOST_MISTAKES = 100
_NAMES_SHOWN = 40
_QUOTED = re.compile(r""""[^"\n]*"|'[^'\n]*'""")
_ENDLESS_KEY = re.compile(r"(?<![\w.-])(?:[\w-]+[ \t]*\.[ \t]*){50}")
NUMBER, PATH, TABLE = "<number>", "<path>", "<table>"  # tags of a union's members; not part of any key
_NESTED_TOO_DEEP = ("tables are nested too deeply", "use a few levels of tables at most")

D = TypeVar("D", bound=Document)


def read_document(path: str | Path, model: type[D]) -> D:
    """Read a TOML file into a model. Raises UsageError with file, key and remedy of each mistake in it.

    >>> import harness
    >>> harness.read_document("personas/speedy.toml", harness.Persona).name
    'speedy'
    """
    path = Path(path)
    remedy = "a UTF-8 TOML file is needed"
    try:
        text = content_of(path, MOST_BYTES).decode("utf-8")
    except FileNotFoundError:
        raise UsageError.of(path, "", "there is no such file", nearest_beside(path)) from None
    except OSError as error:
        raise UsageError.of(path, "", f"cannot be read: {error.strerror}", remedy) from None
    except UnicodeDecodeError as error:
        raise UsageError.of(path, "", f"cannot be read: {error}", remedy) from None
    if text.startswith("\ufeff"):
        raise UsageError.of(path, "", "begins with a byte order mark", "save the file as UTF-8 without one")
    if _ENDLESS_KEY.search(_QUOTED.sub("q", text)):  # reading it would take minutes
        raise UsageError.of(path, "", *_NESTED_TOO_DEEP)
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: besides bad TOML, a number of thousands of digits
        raise UsageError.of(path, "", f"is not valid TOML: {error}", "correct the file at this line") from None
    try:
        return model.model_validate_json(json.dumps(table, default=str))
    except ValidationError as error:
        first = error.errors(include_url=False)[:_MOST_MISTAKES]
        raise UsageError(problem for each in first for problem in _problems(path, model, each)) from None
    except RecursionError:
        raise UsageError.of(path, "", *_NESTED_TOO_DEEP) from None
    except ValueError as error:  # JSON has no NaN and no infinity
        raise UsageError.of(path, "", str(error), "numbers must be finite") from None


def nearest(word: str, words: Iterable[str]) -> str:
    """A remedy: the valid word nearest to a misspelt one, else the valid words (the first 40)."""
    words = sorted(words)
    if not words:
        return "there are none"
    if close := name_like(word, words):
        return f"did you mean {close!r}?"
    more = f" and {len(words) - _NAMES_SHOWN} more" if len(words) > _NAMES_SHOWN else ""
    return f"valid: {', '.join(words[:_NAMES_SHOWN])}{more}"


def nearest_beside(path: Path) -> str:
    """A remedy for a path that leads nowhere: the nearest name in its folder."""
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}"
    return nearest(path.name, [each.name for each in path.parent.iterdir()] or ["(its folder is empty)"])


def one_of(words: Iterable[str], otherwise: str) -> AfterValidator:
    """A check that a text is one of these words; its message begins as given, and names the nearest word."""

    def check(word: str) -> str:
        if word not in words:
            raise ValueError(f"{otherwise} {word!r}: {nearest(word, words)}")
        return word

    return AfterValidator(check)


def _problems(path: Path, model: type[BaseModel], error: Any) -> Iterator[Problem]:
    location = [part for part in error["loc"] if part not in ("function-after", "[key]", NUMBER, PATH, TABLE)]
    named = model.named_location(location) if issubclass(model, Document) else location
    key = ".".join(f"[{part}]" if isinstance(part, int) else str(part) for part in named).replace(".[", "[")
    cause = error.get("ctx", {}).get("error")
    if error["type"] == "extra_forbidden":
        table = _model_at(model, location[:-1])
        yield Problem(
            str(path), key, "unknown key", nearest(str(location[-1]), table.model_fields if table is not None else ())
        )
    elif error["type"] == "missing":
        yield Problem(str(path), key, "is missing", "add it")
    elif error["type"] in ("tuple_type", "list_type") and isinstance(error["input"], dict):
        yield Problem(str(path), key, "is one table", f"write [[{key}]]: a table for each")
    elif isinstance(cause, Mistakes):
        for below, message, remedy in cause.mistakes:
            yield Problem(str(path), ".".join(filter(None, (key, below))), message, remedy)
    elif cause is not None:
        yield Problem(str(path), key, str(cause))
    else:
        message = error["msg"]
        yield Problem(str(path), key, f"{_shown(error['input'])} is not possible", message[0].lower() + message[1:])


def _shown(value: Any) -> str:
    if isinstance(value, dict | list):
        return "this table" if isinstance(value, dict) else "this list"
    return repr(value)[:60]


def _model_at(model: type[BaseModel], location: list[Any]) -> type[BaseModel] | None:
    table: Any = model
    for part in location:
        if isinstance(part, int) or not hasattr(table, "model_fields"):
            continue
        field = table.model_fields.get(part)
        table = _model_in(field.annotation) if field else table  # no field: a key of a table with free keys
    return table if hasattr(table, "model_fields") else None


def _model_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for each in get_args(annotation) if (model := _model_in(each))), None)
