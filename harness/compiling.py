"""Loops over numbers, written in Python and run as machine code (numba), which is kept on disk for the next process.

Sums stay in the order they are written in (no "fast math"): a game's numbers depend on nothing but the game.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

_Function = TypeVar("_Function", bound=Callable[..., object])


def compiled(function: _Function) -> _Function:
    """Compile a function when it is first called. Where nothing can be kept on disk, every process compiles anew."""
    config: Any = numba.config
    usual = config.CACHE_DIR
    config.CACHE_DIR = usual or _folder()
    options: dict[str, Any] = {"error_model": "numpy"}
    try:
        kept: Any = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba found no folder that can be written to
        kept = numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = usual
    return cast(_Function, kept)


@cache
def _folder() -> str:
    """Where machine code is kept. The name tells of all sources: numba alone would look at a function's own file, and
    take no notice when one that it calls, or a constant, changes in another."""
    sources = sorted((Path(__file__).parent / "game").glob("*.py"))
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:24]
    return str(Path(platformdirs.user_cache_dir("harness")) / "compiled" / digest)
