"""Addresses of the recorded games of the page: figures and lists link to them."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.evaluation.worst_first import worst_first
from harness.reports.player_data import key


@dataclass(frozen=True, kw_only=True)
class GameLinks:
    """The games that the page can play, out of a table of games."""

    embedded: Container[str]
    """The keys of the games that the page contains."""
    episodes: pd.DataFrame

    def of(self, rows: pd.DataFrame) -> list[str]:
        """An address for each row's game, empty for a game that the page does not contain."""
        games = zip(rows["arm"].tolist(), rows["seed"].tolist(), rows["episode"].tolist(), strict=True)
        return [self._address(*game) for game in games]

    def worst(self, arm: str) -> str:
        """The address of the worst game of an arm that the page contains; empty without one."""
        found = self.of(worst_first(self.episodes[self.episodes["arm"] == arm]))
        return next(filter(None, found), "")

    def _address(self, arm: str, seed: int, episode: int) -> str:
        name = key(arm, seed, episode)
        return f"#game={name}" if name in self.embedded else ""


NO_LINKS = GameLinks(embedded=(), episodes=pd.DataFrame({"arm": [], "seed": np.zeros(0, int), "episode": []}))
"""Of a page without recorded games."""
