"""How a game ends for a player."""

from __future__ import annotations

from enum import IntEnum


class Outcome(IntEnum):
    """How a player's game ended. `name.lower()` is the value in every file."""

    RUNNING = 0
    GOAL = 1
    COLLISION = 2
    RAIL = 3
    TIMEOUT = 4
    ERROR = 5

    @property
    def word(self) -> str:
        """The outcome's value in files; empty while the game runs."""
        return "" if self is Outcome.RUNNING else self.name.lower()
