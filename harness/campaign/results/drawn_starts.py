"""The starts of a run's games as the scene draws them, and the boundaries of failure that `harness minimise` found."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from harness.campaign.storage.run_folder import RunFolder
from harness.config.pinned_game import PinnedGame, PinnedStart
from harness.config.toml_reading import read_document
from harness.evaluation.start_space import Boundary, start_quantities
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.seeding import parts_of
from harness.road.scene.open_scene import OpenScene


def drawn_starts(scene: OpenScene, start_seed: int, episodes: Iterable[int]) -> pd.DataFrame:
    """The quantities that differ between the starts of these episodes, a column each; the index is the episode."""
    numbers = sorted({*episodes})
    drawn = [draw_initial_state(scene.usual_starts, *parts_of(start_seed, episode)) for episode in numbers]
    if not drawn:
        return pd.DataFrame()
    found = _quantities(scene, drawn)
    found["friction"] = [each.friction for each in drawn]
    found["visibility_m"] = [each.visibility_m for each in drawn]
    found["speed_limit_share"] = [each.limit_share for each in drawn]
    if len(scene.world.right_of_way.signal_links):
        found["signal_place"] = [each.signal_place for each in drawn]
    found.index = pd.Index(numbers, name="episode")
    return found.loc[:, found.nunique() > 1]


def found_boundaries(folder: RunFolder, scene: OpenScene) -> list[Boundary]:
    """The boundaries of the pinned games in the run folder. Raises UsageError for one that can't be read."""
    games = [read_document(file, PinnedGame) for file in folder.pinned_games]
    return [_boundary(game, scene) for game in games if len(game.people) == len(scene.places) - 1]


def _boundary(game: PinnedGame, scene: OpenScene) -> Boundary:
    starts = [each for each in (game.drawn_start, game.start, game.no_failure_from) if each is not None]
    return Boundary(arm=game.arm, seed=game.seed, episode=game.episode, starts=_quantities(scene, starts))


def _quantities(scene: OpenScene, starts: Sequence[InitialState] | Sequence[PinnedStart]) -> pd.DataFrame:
    position_m, speed_mps = (np.array([getattr(each, name) for each in starts]) for name in ("position_m", "speed_mps"))
    return start_quantities(scene.places, position_m, speed_mps)


def people_drive(scene: OpenScene) -> bool:
    """Whether all people of a scene are drivers of cars."""
    return all(each.drives for each in scene.document.non_ego)
