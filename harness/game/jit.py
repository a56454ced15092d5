"""Compilation of numeric loops to machine code (numba), cached on disk for later processes.

Floating-point operations keep the order of the source (no "fast math"): results depend only on the game.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import logging
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs
from numba.core import event

_Function = TypeVar("_Function", bound=Callable[..., object])

COMPILING = "compiling numeric loops, once per installation"
_LOGGER = logging.getLogger("harness.preparation")
_functions: set[object] = set()  # to be compiled; numba compiles functions of its own besides


def compiled(function: _Function) -> _Function:
    """Compile a function on its first call.

    Processes that compile the same version of a package do so in turns, so that each finds the machine code of the
    others on disk. If no folder is writable, every process compiles for itself. With NUMBA_DISABLE_JIT=1 in the
    environment, nothing is compiled: for short programs, debuggers and coverage.
    """
    config: Any = numba.config
    if config.DISABLE_JIT:
        return function
    _functions.add(function)
    default = config.CACHE_DIR
    config.CACHE_DIR = default or _folder(Path(function.__code__.co_filename).parent)
    options: dict[str, Any] = {"error_model": "numpy"}
    try:
        dispatcher: Any = numba.njit(cache=True, **options)(function)
        # `compile` reads the cache on disk first
        dispatcher.compile = _turn(Path(config.CACHE_DIR))(dispatcher.compile)
    except RuntimeError:  # numba found no writable folder
        dispatcher = numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = default
    return cast(_Function, dispatcher)


class _Compilations(event.Listener):
    """Logs each function that is compiled. One whose machine code is on disk is only loaded, and is not logged."""

    def __init__(self) -> None:
        self._done: set[object] = set()

    def on_start(self, event: event.Event) -> None:
        _LOGGER.info(COMPILING, extra={"done": len(self._done & _functions), "total": len(_functions)})

    def on_end(self, event: event.Event) -> None:
        self._done.add(event.data["dispatcher"].py_func)  # once per function, however many types it is compiled for


event.register("numba:compile", _Compilations())


@contextlib.contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Only this thread of this process compiles functions with this folder of the cache, and functions that they call,
    in the block or the function that it decorates. The turn of a process that dies ends with it."""
    with contextlib.ExitStack() as stack:
        # a file system without locks is no error; a lock made of a file's existence would outlive its process
        with contextlib.suppress(OSError, NotImplementedError):
            stack.enter_context(_lock(folder, os.getpid()))
        yield


@cache
def _lock(folder: Path, process: int) -> contextlib.AbstractContextManager[object]:
    """This process's lock of a folder of the cache that processes share. A thread may enter it again: compiling a
    function may compile those that it calls. Raises OSError if the folder can't be written."""
    from filelock import FileLock  # imports asyncio and sqlite3: only for processes that run compiled code

    folder.mkdir(parents=True, exist_ok=True)
    return FileLock(folder / "turn", fallback_to_soft=False)


atexit.register(_lock.cache_clear)  # filelock prints an error for a lock that outlives its modules


@cache
def _folder(package: Path) -> str:
    """The cache's folder for functions of a package, named by a digest of all its sources and of this package's.

    numba invalidates its cache by a function's own file only, not by the functions and constants that it uses.
    """
    sources = [each for folder in (Path(__file__).parent, package) for each in sorted(folder.glob("*.py"))]
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:24]
    return str(Path(platformdirs.user_cache_dir("harness")) / "compiled" / digest)


def inlined(function: _Function) -> _Function:
    """Copy a function into the compiled functions that call it: arrays that are passed to it cost no time."""
    options: dict[str, Any] = {"inline": "always"}
    return cast(_Function, numba.njit(**options)(function))
