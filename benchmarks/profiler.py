"""Seconds of the parts of a piece of work."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any


class Profiler:
    """Seconds of each part, without those of the parts inside it."""

    def __init__(self) -> None:
        self.total_s: dict[str, float] = {}
        self._pending_s: dict[str, float] = {}
        self._inner_s = [0.0]  # of the parts inside each part that is running, outermost first

    def commit(self) -> None:
        """Add the seconds since the last call of `commit` or `discard` to the total."""
        for part, seconds in self._pending_s.items():
            self.total_s[part] = self.total_s.get(part, 0.0) + seconds
        self._pending_s.clear()

    def discard(self) -> None:
        """Forget the seconds since the last call of `commit` or `discard`."""
        self._pending_s.clear()

    def wrap(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, with its time counted to the part."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inner_s.append(0.0)
            start_s = time.perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                taken_s = time.perf_counter() - start_s
                self._pending_s[part] = self._pending_s.get(part, 0.0) + taken_s - self._inner_s.pop()
                self._inner_s[-1] += taken_s

        return timed
