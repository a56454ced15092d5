"""What a simulation plays: its games, and SUMO's options for them."""

from __future__ import annotations

from dataclasses import dataclass

from harness.road.demand.warm_up import LANE_CHANGE_S
from harness.road.net.tiles import nets_can_share
from harness.road.scene.open_scene import OpenScene

_LATERAL_RESOLUTION_M = 0.8  # as in SUMO's documentation of the sublane model: a quarter of a lane


@dataclass(frozen=True, kw_only=True)
class SceneGames:
    """The games of a simulation: how many, on which scene, and which players [P] the harness drives."""

    scene: OpenScene
    games: int
    taken_over: tuple[bool, ...]
    recorded: bool = False
    """Whether every background vehicle is read in every step, near a player or not."""

    @property
    def steady(self) -> bool:
        """Whether SUMO draws no random number and changes no lane: it drives no player, and other vehicles are steady,
        such as the one that may follow the ego."""
        return all(self.taken_over) and self.scene.has_steady_traffic

    @property
    def in_one_place(self) -> bool:
        """Whether the tiles of an assessment lie on each other, so that what SUMO computes in a game is the same, to
        the last bit, in every tile. It looks for lanes along the routes of a car then, which are in its tile."""
        return self.recorded and self.steady

    @property
    def options(self) -> list[str]:
        """SUMO's options, besides the names of files and the seed."""
        # SUMO 1.28 may crash (SIGSEGV) if a placed car leaves a junction's lanes and lane changes take time: they take
        # time only if SUMO drives a vehicle that changes lanes.
        duration_s = 0.0 if self.steady else LANE_CHANGE_S
        lateral = ["--lanechange.duration", str(duration_s)]
        if self._needs_sublanes():
            lateral = ["--lateral-resolution", str(_LATERAL_RESOLUTION_M)]  # SUMO accepts one of the two options
        return [
            *("--step-length", str(self.scene.document.step_length_s), "--collision.action", "none"),
            *lateral,
            *("--time-to-teleport", "-1", "--no-step-log", "--no-warnings", "--xml-validation", "never"),
        ]

    def _needs_sublanes(self) -> bool:
        """Whether a player that SUMO drives has the lane-change model SL2015, which requires sublanes."""
        types = self.scene.routes.types
        driven = [player for player, taken_over in enumerate(self.taken_over) if not taken_over]
        return any(types[self.scene.vehicle(player).vehicle_type].lane_changes == "SL2015" for player in driven)


def can_share(first: SceneGames, second: SceneGames) -> bool:
    """Whether the games of two simulations can be in one SUMO."""
    return first.options == second.options and nets_can_share(first.scene.net_file, second.scene.net_file)
