"""Loops over numbers, written in Python and run as machine code (numba), which is kept on disk for the next process.

Sums stay in the order they are written in (no "fast math"): a game's numbers depend on nothing but the game.
"""

from __future__ import annotations

import contextlib
import hashlib
import threading
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

try:
    import fcntl
except ImportError:  # Windows: processes may compile the same
    fcntl = None  # type: ignore[assignment]

_Function = TypeVar("_Function", bound=Callable[..., object])


def compiled(function: _Function) -> _Function:
    """Compile a function when it is first called. Processes take turns, so that what one compiles the others find on
    disk; where nothing can be kept there, every process compiles anew."""
    config: Any = numba.config
    usual = config.CACHE_DIR
    config.CACHE_DIR = usual or _folder()
    options: dict[str, Any] = {"error_model": "numpy"}
    try:
        kept: Any = numba.njit(cache=True, **options)(function)
        kept.compile = _in_turn(kept.compile)  # which looks on disk first
    except RuntimeError:  # numba found no folder that can be written to
        kept = numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = usual
    return cast(_Function, kept)


def _in_turn(work: Callable[..., object]) -> Callable[..., object]:
    def in_turn(*arguments: object) -> object:
        with _turn():
            return work(*arguments)

    return in_turn


_threads = threading.RLock()
_depth = 0  # one function's compilation may need another's


@contextlib.contextmanager
def _turn() -> Iterator[None]:
    """Only this thread of this process compiles meanwhile. The system ends the turn of a process that dies."""
    global _depth
    with _threads, contextlib.ExitStack() as held:
        if _depth == 0 and fcntl is not None:
            with contextlib.suppress(OSError):  # no place to meet
                folder = Path(_folder())
                folder.mkdir(parents=True, exist_ok=True)
                lock = held.enter_context((folder / "turn").open("a"))
                fcntl.flock(lock, fcntl.LOCK_EX)
        _depth += 1
        try:
            yield
        finally:
            _depth -= 1


@cache
def _folder() -> str:
    """Where machine code is kept. The name tells of all sources: numba alone would look at a function's own file, and
    take no notice when one that it calls, or a constant, changes in another."""
    sources = sorted((Path(__file__).parent).glob("*.py"))
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:24]
    return str(Path(platformdirs.user_cache_dir("harness")) / "compiled" / digest)
