"""Parameters that a search may change for a better driver: how a driver document declares them.

[tunable]
time_gap_s = [0.8, 2.5]     # a parameter of the document's, and between what it may be
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
    """A parameter that a search may change: its key, and between what."""

    key: str
    low: float
    high: float


class Adjustable(Document):
    """A driver document with parameters, of which some may be searched."""

    parameter_table: ClassVar[str]
    """The key of the table in which its parameters are."""

    tunable: dict[ParameterName, Range] | None = Field(None, max_length=100)
    """Parameters that may be searched for a better driver, each with the least and the greatest value it may have.
    What the document says they are has to be in between: the search begins there."""

    @field_validator("tunable", mode="before")
    @classmethod
    def _dotted(cls, tunable: Any) -> Any:
        for key, each in tunable.items() if isinstance(tunable, dict) else ():
            if isinstance(each, dict) and each:
                raise ValueError(
                    f'a name with a point in it needs quotes, as in "{key}.{next(iter(each))}" = [1.0, 2.0]'
                )
        return tunable

    @model_validator(mode="after")
    def _can_be_searched(self) -> Self:
        found = [mistake for tunable in self.declared if (mistake := self._mistake(tunable))]
        if found:
            raise Mistakes(found)
        return self

    @property
    def declared(self) -> tuple[Tunable, ...]:
        """What the document says may be searched."""
        return tuple(Tunable(key, low, high) for key, (low, high) in (self.tunable or {}).items())

    @property
    def searched(self) -> tuple[Tunable, ...]:
        """What may be searched, in this order. Nothing: the driver has nothing to tune."""
        return self.declared

    @property
    def numbers(self) -> dict[str, float]:
        """Every parameter that is a number, by the key that `tunable` calls it by."""
        table: Mapping[str, Any] = getattr(self, self.parameter_table)
        return {key: value for key, value in table.items() if type(value) in (int, float)}

    def tuned(self, values: Mapping[str, float]) -> Self:
        """This driver with other values of parameters that may be searched. Raises KeyError for a key that is none,
        ValueError (pydantic's) for a value that can't be."""
        known = {each.key for each in self.searched}
        for key in values:
            if key not in known:
                raise KeyError(key)
        return self._with(values, self.tunable)

    def _with(self, values: Mapping[str, float], tunable: Any) -> Self:
        document = self.model_dump()
        for key, value in values.items():
            self._put(document, key, value)
        return type(self).model_validate(document | {"tunable": tunable})

    def _put(self, document: dict[str, Any], key: str, value: float) -> None:
        """Set a parameter in a dump of the document."""
        document[self.parameter_table][key] = value

    def _mistake(self, tunable: Tunable) -> tuple[str, str, str] | None:
        """Key, message and remedy of what is wrong with something declared."""
        key, low, high = tunable
        place, now = f"tunable.{key}", self.numbers.get(key)
        if now is None:
            known = nearest(key, self.numbers) if self.numbers else "it has no parameters that are numbers"
            return place, "the document gives no parameter of this name a number", known
        if not low < high:
            return place, f"{low:g} to {high:g} is nothing to search in", "the lower bound first"
        if not low <= now <= high:
            return place, f"the document's own value, {now:g}, is not from {low:g} to {high:g}", "change one of them"
        for value in (low, high):
            try:
                self._with({key: value}, {})
            except ValidationError as error:
                return place, f"it can't be {value:g}: {error.errors()[0]['msg']}", "change this bound"
        return None
