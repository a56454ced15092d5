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
        where = f"{self.file}: {self.key}" if self.key else self.file
        return f"{where}: {self.message}" + (f" ({self.remedy})" if self.remedy else "")


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


def attempt(problems: list[Problem], action: Callable[[], T]) -> T | None:
    """The action's result, or None: the user's mistakes in it join `problems`, so that the rest is looked at too."""
    try:
        return action()
    except UsageError as error:
        problems.extend(error.problems)
        return None
