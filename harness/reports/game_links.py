"""The recorded games of a run: their addresses on the page, and the commands that open them on the desktop."""

from __future__ import annotations

import math
import shlex
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.people import COLLIDED_WITH, judged
from harness.evaluation.worst_first import worst_first
from harness.reports.numbers import NO_SPACE, number
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


OUTCOMES = {"rail": "contact with the rail", "timeout": "out of time", "goal": "goal reached"}
"""Outcomes in words, where the name is not clear."""


@dataclass(frozen=True, kw_only=True)
class ListedReplay:
    """A recorded game and how to watch it."""

    game: str
    outcome: str
    min_ttc: str
    command: str
    scene: str
    watch: str
    """Key of the game if the page can play it, else empty."""


def replay_list(names: Sequence[str], episodes: pd.DataFrame, embedded: Container[str]) -> list[ListedReplay]:
    """The replays, worst first.

    `embedded` are the keys of the games that the page can play.
    """
    several_seeds, wanted = episodes["seed"].nunique() > 1, set(names)
    games = [game for game in worst_first(episodes).to_dict("records") if _name(game) in wanted]
    return [_replay(_name(game), game, several_seeds, embedded) for game in games]


def worst_game(arms: Mapping[str, str], episodes: pd.DataFrame, embedded: Container[str]) -> tuple[str, str] | None:
    """Key and description of the worst game of `arms`, which are labelled, of those games that the page can play; None
    where it can play none."""
    games = worst_first(episodes[episodes["arm"].isin(list(arms))]).to_dict("records")
    game = next((game for game in games if _key(game) in embedded), None)
    if game is None:
        return None
    (_, outcome), ttc = judged(game), game["ego_min_ttc_s"]
    seed = f", seed {game['seed']}" if episodes["seed"].nunique() > 1 else ""
    name = f"{arms[game['arm']]}{seed}, game {game['episode']}"
    nearest = f", least time to collision {number(ttc, 1)} s" if 0 < ttc < math.inf else ""
    return _key(game), f"{name}: {OUTCOMES.get(outcome, outcome)}{_with(game)}{_impact(game)}{nearest}"


def most_severe(episodes: pd.DataFrame) -> Mapping[Any, Any]:
    """The worst of these games, of which there is at least one."""
    return worst_first(episodes).head(1).to_dict("records")[0]


def _name(game: Mapping[Any, Any]) -> str:
    return f"{game['arm']}-seed{game['seed']}-{game['episode']:03d}"


def _key(game: Mapping[Any, Any]) -> str:
    return key(game["arm"], game["seed"], game["episode"])


def _replay(name: str, game: Mapping[Any, Any], several_seeds: bool, embedded: Container[str]) -> ListedReplay:
    arm, seed, episode = game["arm"], game["seed"], game["episode"]
    who, outcome = judged(game)
    return ListedReplay(
        game=f"{arm}, seed {seed}, game {episode}" if several_seeds else f"{arm}, game {episode}",
        outcome=f"{_in_words(who)}: {outcome}{_with(game)}{_impact(game)}",
        min_ttc=number(game["ego_min_ttc_s"], 2),
        command=f"harness replay . {shlex.quote(arm)} {episode}" + (f" --seed {seed}" if several_seeds else ""),
        scene=f"sumo-gui -c {shlex.quote(f'replays/{name}/scene.sumocfg')}",
        watch=_key(game) if _key(game) in embedded else "",
    )


def _in_words(name: str) -> str:
    return name.replace("non_ego", "non-ego").replace("_", " ")


def _with(game: Mapping[Any, Any]) -> str:
    """What the ego collided with, where a table of several people has it."""
    other = game.get(COLLIDED_WITH, "")
    return f" with {_in_words(other) if other != 'background' else 'background traffic'}" if other else ""


def _impact(game: Mapping[Any, Any]) -> str:
    """How hard a contact of the ego was, and on which side; empty without one."""
    speed = game.get("closing_speed_mps", math.nan)
    if speed != speed:
        return ""
    own, other = (f"{number(game[f'{who}_delta_v_mps'], 1)}{NO_SPACE}m/s" for who in ("ego", "other"))
    of_other = f", of the other {other}" if other != own else ""
    return f", {game['impact_side']} side at {number(speed, 1)}{NO_SPACE}m/s (delta-v {own}{of_other})"
