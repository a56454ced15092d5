"""The error tree.

HarnessError                 any error that the harness raises
├── UsageError               an error of the user: printed without a traceback, exit code 2
├── StageFailed              a training or an assessment could not be finished; the message names the stage
├── SimulationError          SUMO refused a command, died or lost a vehicle
└── DriverError              an external driver died, was late or gave an invalid answer
"""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from errno import EDQUOT, EFBIG, EIO, ENOSPC, EROFS
from typing import TypeVar

T = TypeVar("T")
FAILED, USAGE_ERROR, NOT_ACCEPTED = 1, 2, 3
"""Exit codes: games, stages or checks failed; a mistake of the user; a bound of [acceptance] is not kept."""
MOST_PROBLEMS = 20
"""Of one kind, in one answer."""
_LONGEST = 2_000  # characters of each part of a problem


class HarnessError(Exception):
    """Base of all errors that the harness raises.

    >>> import harness
    >>> try:
    ...     harness.load("nowhere")
    ... except harness.HarnessError as error:
    ...     print(type(error).__name__)
    UsageError
    """


@dataclass(frozen=True, order=True)
class Problem:
    """One error that the user can correct: file, key, message and remedy."""

    file: str
    key: str
    message: str
    remedy: str = ""

    def __str__(self) -> str:
        """One line of plain text: names in a document can't control a terminal or imitate another message."""
        parts = (self.key, self.message, self.remedy)
        key, message, remedy = (each if len(each) <= _LONGEST else f"{each[:_LONGEST]} ..." for each in parts)
        where = f"{self.file}: {key}" if key else self.file
        return plain(f"{where}: {message}" + (f" ({remedy})" if remedy else ""))


def plain(text: str) -> str:
    """The text with all unprintable characters escaped: line ends, control characters, invisible marks."""
    if text.isprintable():
        return text
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape", "surrogatepass").decode() for char in text
    )


class UsageError(HarnessError):
    """An error of the user, as a list of problems: all problems are reported at once.

    >>> import harness
    >>> try:
    ...     harness.DrivingEnv(player="nonego")
    ... except harness.UsageError as error:
    ...     print(error.problems[0].remedy)
    did you mean 'non_ego'?
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = sorted(set(problems))
        super().__init__("\n".join(str(problem) for problem in self.problems))

    @classmethod
    def of(cls, file: object, key: str, message: str, remedy: str = "") -> UsageError:
        """An error with one problem."""
        return cls([Problem(str(file), key, message, remedy)])


LEARNERS = ("torch", "stable_baselines3", "tensorboard")
"""Packages of the extra `training`."""


def without_learners(needed_by: str) -> UsageError:
    """The error for what can't be done without the extra `training`."""
    message = "needs PyTorch and Stable-Baselines3, which are not installed"
    return UsageError.of(needed_by, "", message, "pip install 'safedriverl-harness[training]'")


class StageFailed(HarnessError):
    """A training or an assessment could not be finished."""


class SimulationError(HarnessError):
    """SUMO refused a command, died, or lost a vehicle.

    >>> import harness
    >>> issubclass(harness.SimulationError, harness.HarnessError)
    True
    """


class DriverError(HarnessError):
    """An external driver died, was late, or gave an invalid answer."""


_OUT_OF_MEMORY = ("allocate memory", "failed to map segment", "can't start new thread", "bad_alloc")


def is_of_memory(error: BaseException) -> bool:
    """Whether an error means that memory ran out. Libraries report this by different errors."""
    return isinstance(error, MemoryError) or any(words in str(error) for words in _OUT_OF_MEMORY)


def short_of_memory(error: BaseException) -> str:
    """One line for an error that means that memory ran out."""
    remedy = limited_memory() or "end other programs, or run fewer stages at once with --jobs"
    return f"the machine is short of memory: {str(error) or 'no more could be allocated'} ({remedy})"


def address_space_bytes() -> float:
    """The limit of this process's address space; infinity without one, and on Windows, which has none."""
    if sys.platform == "win32":
        return math.inf
    import resource

    limit_bytes = resource.getrlimit(resource.RLIMIT_AS)[0]
    return math.inf if limit_bytes == resource.RLIM_INFINITY else float(limit_bytes)


def limited_memory() -> str:
    """The limit of this process's address space and how to raise it, in words; empty without a limit."""
    limit_bytes = address_space_bytes()
    if limit_bytes == math.inf:
        return ""
    return f"each process may use {limit_bytes / 1e9:.1f} GB of address space: raise this limit, ulimit -v"


def is_of_disk(error: BaseException) -> bool:
    """Whether an error means that the disk takes no more."""
    return isinstance(error, OSError) and error.errno in (ENOSPC, EDQUOT, EFBIG, EIO, EROFS)


def of_system(error: OSError) -> str:
    """The file of an error of the operating system, if it names one, and the reason."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename else reason


def collect(problems: list[Problem], action: Callable[[], T]) -> T | None:
    """The action's result; on a UsageError, None, and the error's problems are added to `problems`."""
    try:
        return action()
    except UsageError as error:
        problems.extend(error.problems)
        return None


_ALIKE = 0.65  # the `difflib.SequenceMatcher.ratio` from which a name is a misspelling of another
_COMPARED_CHARACTERS = 200


def name_like(word: str, names: Iterable[str]) -> str | None:
    """The name that a word is a misspelling of; None if it is like none of them."""
    close = difflib.get_close_matches(word[:_COMPARED_CHARACTERS], sorted(names), n=1, cutoff=_ALIKE)
    return close[0] if close else None
