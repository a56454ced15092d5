"""The recorded games of a run: their addresses on the page, and the commands that open them on the desktop."""

from __future__ import annotations

import math
import shlex
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.evaluation.people import COLLIDED_WITH, judged
from harness.evaluation.worst_first import replay_name, worst_first
from harness.game.roles import role_in_words
from harness.reports.embedding import key
from harness.reports.figures import GAME
from harness.reports.numbers import NO_SPACE, number

OUTCOMES = {"rail": "contact with the rail", "timeout": "out of time", "goal": "goal reached"}
"""Outcomes in words, where the name is not clear."""


@dataclass(frozen=True, kw_only=True)
class GameLinks:
    """The games that the page can play, out of a table of games."""

    embedded: Container[str]
    """The keys of the games that the page contains."""
    episodes: pd.DataFrame

    def of(self, rows: pd.DataFrame) -> list[str]:
        """An address for each row's game, empty for a game that the page does not contain."""
        keys = map(key, rows["arm"].tolist(), rows["seed"].tolist(), rows["episode"].tolist())
        return [f"{GAME}{name}" if name in self.embedded else "" for name in keys]

    def worst(self, arm: str) -> str:
        """The address of the worst game of an arm that the page contains; empty without one."""
        found = self.of(worst_first(self.episodes[self.episodes["arm"] == arm]))
        return next(filter(None, found), "")

    def worst_of(self, arms: Mapping[str, str]) -> tuple[str, str] | None:
        """Key and description of the worst game of `arms`, which are labelled, of those that the page contains; None
        where it contains none."""
        games = worst_first(self.episodes[self.episodes["arm"].isin(list(arms))]).to_dict("records")
        game = next((game for game in games if _key(game) in self.embedded), None)
        if game is None:
            return None
        (_, outcome), ttc = judged(game), game["ego_min_ttc_s"]
        seed = f", seed {game['seed']}" if self.episodes["seed"].nunique() > 1 else ""
        name = f"{arms[game['arm']]}{seed}, game {game['episode']}"
        nearest = f", least time to collision {number(ttc, 1)} s" if 0 < ttc < math.inf else ""
        return _key(game), f"{name}: {OUTCOMES.get(outcome, outcome)}{_with(game)}{_impact(game)}{nearest}"

    def replays(self, names: Sequence[str], most: int) -> list[dict[str, str]]:
        """The worst of the replays with these names: each game, its outcome, and how to watch it. `watch` is the key of
        a game that the page contains, else empty."""
        wanted, several_seeds = set(names), self.episodes["seed"].nunique() > 1
        games = [game for game in worst_first(self.episodes).to_dict("records") if _name(game) in wanted][:most]
        found = []
        for game in games:
            who, outcome = judged(game)
            seed = f", seed {game['seed']}" if several_seeds else ""
            found.append(
                {
                    "game": f"{game['arm']}{seed}, game {game['episode']}",
                    "outcome": f"{role_in_words(who)}: {outcome}{_with(game)}{_impact(game)}",
                    "min_ttc": number(game["ego_min_ttc_s"], 2),
                    "command": replay_command(game, several_seeds),
                    "scene": f"sumo-gui -c {shlex.quote(f'replays/{_name(game)}/scene.sumocfg')}",
                    "watch": _key(game) if _key(game) in self.embedded else "",
                }
            )
        return found


def replay_command(game: Mapping[Any, Any], several_seeds: bool) -> str:
    """The command that shows a game, typed in the run folder."""
    seed = f" --seed {game['seed']}" if several_seeds else ""
    return f"harness replay . {shlex.quote(game['arm'])} {game['episode']}{seed}"


def _name(game: Mapping[Any, Any]) -> str:
    return replay_name(game["arm"], game["seed"], game["episode"])


def _key(game: Mapping[Any, Any]) -> str:
    return key(game["arm"], game["seed"], game["episode"])


def _with(game: Mapping[Any, Any]) -> str:
    """What the ego collided with, where a table of several people has it."""
    other = game.get(COLLIDED_WITH, "")
    return f" with {role_in_words(other) if other != 'background' else 'background traffic'}" if other else ""


def _impact(game: Mapping[Any, Any]) -> str:
    """How hard a contact of the ego was, and on which side; empty without one."""
    speed = game.get("closing_speed_mps", math.nan)
    if speed != speed:
        return ""
    own, other = (f"{number(game[f'{who}_delta_v_mps'], 1)}{NO_SPACE}m/s" for who in ("ego", "other"))
    of_other = f", of the other {other}" if other != own else ""
    return f", {game['impact_side']} side at {number(speed, 1)}{NO_SPACE}m/s (delta-v {own}{of_other})"
