"""Tunable parameters: how a driver document declares the parameters that a search may change.

[tunable]
time_gap_s = [0.8, 2.5]     # a parameter of the document, with its lower and upper bound
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import Field, ValidationError, field_validator, model_validator
from typing_extensions import Self

from harness.config.toml_reading import Document, Mistakes, nearest

ParameterName = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
Range = Annotated[list[Annotated[float, Field(ge=-1e9, le=1e9)]], Field(min_length=2, max_length=2)]


class Tunable(NamedTuple):
    """A parameter that a search may change, with its bounds."""

    key: str
    low: float
    high: float


class Adjustable(Document):
    """A driver document with parameters, some of which may be tunable."""

    parameter_table: ClassVar[str]
    """The key of the table of parameters."""

    tunable: dict[ParameterName, Range] | None = Field(None, max_length=100)
    """Tunable parameters, each with its lower and upper bound. The value in the document must be within the bounds: the
    search starts there."""

    @field_validator("tunable", mode="before")
    @classmethod
    def _dotted_names_are_quoted(cls, tunable: Any) -> Any:
        for key, each in tunable.items() if isinstance(tunable, dict) else ():
            if isinstance(each, dict) and each:
                raise ValueError(f'a name with a dot needs quotes, as in "{key}.{next(iter(each))}" = [1.0, 2.0]')
        return tunable

    @model_validator(mode="after")
    def _can_be_searched(self) -> Self:
        mistakes = [mistake for tunable in self.declared if (mistake := self._mistake(tunable))]
        if mistakes:
            raise Mistakes(mistakes)
        return self

    @property
    def declared(self) -> tuple[Tunable, ...]:
        """The tunable parameters that the document declares."""
        return tuple(Tunable(key, low, high) for key, (low, high) in (self.tunable or {}).items())

    @property
    def searched(self) -> tuple[Tunable, ...]:
        """The tunable parameters, in the order of the search; empty if there are none."""
        return self.declared

    @property
    def numbers(self) -> dict[str, float]:
        """All parameters that are numbers, by their names in `tunable`."""
        table: Mapping[str, Any] = getattr(self, self.parameter_table)
        return {key: value for key, value in table.items() if type(value) in (int, float)}

    def tuned(self, values: Mapping[str, float]) -> Self:
        """This driver with other values of tunable parameters. Raises KeyError for a key that is not tunable, and
        pydantic's ValidationError, a ValueError, for a value that is not valid."""
        known = {each.key for each in self.searched}
        for key in values:
            if key not in known:
                raise KeyError(key)
        return self._with(values, self.tunable)

    def _with(self, values: Mapping[str, float], tunable: Any) -> Self:
        document = self.model_dump()
        for key, value in values.items():
            self._set(document, key, value)
        return type(self).model_validate(document | {"tunable": tunable})

    def _set(self, document: dict[str, Any], key: str, value: float) -> None:
        document[self.parameter_table][key] = value

    def _mistake(self, tunable: Tunable) -> tuple[str, str, str] | None:
        """Key, message and remedy of the mistake in a declared parameter, if there is one."""
        key, low, high = tunable
        place, value = f"tunable.{key}", self.numbers.get(key)
        if value is None:
            known = nearest(key, self.numbers) if self.numbers else "the document has no parameters that are numbers"
            return place, "the document has no number of this name", known
        if not low < high:
            return place, f"the range {low:g} to {high:g} is empty", "write the lower bound first"
        if not low <= value <= high:
            message = f"the value in the document, {value:g}, is not within {low:g} to {high:g}"
            return place, message, "change one of them"
        for bound in (low, high):
            try:
                self._with({key: bound}, {})
            except ValidationError as error:
                return place, f"the value {bound:g} is not valid: {error.errors()[0]['msg']}", "change this bound"
        return None
