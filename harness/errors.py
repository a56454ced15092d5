"""The error tree.

HarnessError                 anything the harness itself raises
├── UsageError               the user's mistake: printed without a traceback, exit code 2
├── StageFailed              a training or an assessment could not be finished, named by its stage
├── SimulationError          SUMO refused, died or lost a vehicle
└── DriverError              a driver that somebody brought died, was late or gave no answer that is one
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")
_LONGEST = 2_000  # characters of what is said of one problem


class HarnessError(Exception):
    """Anything the harness itself raises."""


@dataclass(frozen=True, order=True)
class Problem:
    """One thing the user can mend: where it is, what is wrong, and what to do about it."""

    file: str
    key: str
    message: str
    remedy: str = ""

    def __str__(self) -> str:
        """One line, whatever the names in it: what a document says can't steer a terminal or feign another message."""
        key, message, remedy = (_shortened(part) for part in (self.key, self.message, self.remedy))
        where = f"{self.file}: {key}" if key else self.file
        return plain(f"{where}: {message}" + (f" ({remedy})" if remedy else ""))


def plain(text: str) -> str:
    """The text with everything but letters, signs and plain spaces escaped: line ends, controls, invisible marks."""
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else each.encode("unicode_escape", "surrogatepass").decode() for each in text
    )


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


class UsageError(HarnessError):
    """The user's mistake, as a list of problems, so that all are shown at once."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = sorted(set(problems))
        super().__init__("\n".join(str(problem) for problem in self.problems))

    @classmethod
    def of(cls, file: object, key: str, message: str, remedy: str = "") -> UsageError:
        return cls([Problem(str(file), key, message, remedy)])


class StageFailed(HarnessError):
    """A training or an assessment could not be finished."""


class SimulationError(HarnessError):
    """SUMO refused a command, died, or lost a vehicle it was given."""


class DriverError(HarnessError):
    """A driver that somebody brought died, was late, or gave no answer that is one."""


_OUT_OF_MEMORY = ("allocate memory", "failed to map segment", "can't start new thread", "bad_alloc")


def is_of_memory(error: BaseException) -> bool:
    """Whether an error says that the machine is short of memory: libraries have each their own for it."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _OUT_OF_MEMORY)


def collect(problems: list[Problem], action: Callable[[], T]) -> T | None:
    """The action's result, or None: the user's mistakes in it join `problems`, so that the rest is looked at too."""
    try:
        return action()
    except UsageError as error:
        problems.extend(error.problems)
        return None
