"""The columns of severity of one recorded game, from its trace. `columns` defines each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.severity import thresholds as at
from harness.evaluation.severity.contact import impact_angle_rad, needed_braking_mps2, post_encroachment_s
from harness.evaluation.severity.masses import mass_kg
from harness.evaluation.trace_quantities import body_names, drove_in, obstacle_names, quantities_of
from harness.game.arrays import BoolArray, FloatArray
from harness.game.bicycle import GRAVITY_MPS2
from harness.game.geometry import Box, box_distance
from harness.game.outcome import Outcome
from harness.game.quantities import SIGHT_M, Quantities
from harness.game.roles import EGO
from harness.game.world import World

CONTACT, RAIL, TIMEOUT = 300.0, 200.0, 100.0
"""What `severity` adds up from, in games with such an end."""
_MOST_MPS = 99.0


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What a contact depends on, of a vehicle type. The defaults are those of SUMO."""

    length_m: float = 5.0
    width_m: float = 1.8
    vehicle_class: str = "passenger"


def severity_of(trace: pd.DataFrame, world: World, kinds: Mapping[str, Kind]) -> dict[str, Any]:
    """The cells of `SEVERITY_COLUMNS` of one game's trace, None where one can't be measured.

    `kinds` are the vehicle types in the trace; one without an entry is SUMO's default. In a game without the ego, the
    person that drives is judged: such a game has the severity alone.
    """
    roles = [role for role in world.roles if (trace["player"] == role).any()]
    if not roles:
        return {}
    drive = _Drive.of(trace, world, kinds, world.roles.index(roles[0]))
    cells = drive.contact_cells() | drive.closeness_cells()
    severity = {"severity": drive.severity(cells)}
    return cells | severity if drive.player == EGO else severity


@dataclass(frozen=True, kw_only=True)
class _Drive:
    """The judged player's game until its end; row t of arrays is its t-th step, without the start."""

    player: int
    outcome: str
    q: Quantities
    drove: BoolArray
    """[T] of all steps of the trace."""
    masses_kg: FloatArray
    """[B] inf: an obstacle, which does not move."""

    @classmethod
    def of(cls, trace: pd.DataFrame, world: World, kinds: Mapping[str, Kind], player: int) -> _Drive:
        """The drive of a player of the world."""
        types = {str(row.player): str(row.vehicle_type) for row in trace.drop_duplicates("player").itertuples()}
        by_name = {name: kinds.get(kind, Kind()) for name, kind in types.items()}
        q = quantities_of(trace, world, {name: (kind.length_m, kind.width_m) for name, kind in by_name.items()})
        names = body_names(trace, world)
        fixed = obstacle_names(world)
        masses = [np.inf if name in fixed else mass_kg(by_name.get(name, Kind()).vehicle_class) for name in names]
        own = trace.loc[trace["player"] == world.roles[player], "outcome"]
        ends = own[own != ""]
        drove = drove_in(trace, world.roles)[:, player].copy()
        drove[0] = False
        outcome = str(ends.iloc[0]) if len(ends) else Outcome.RUNNING.word
        return cls(player=player, outcome=outcome, q=q, drove=drove, masses_kg=np.array(masses))

    # --- a contact -------------------------------------------------------------------------------------------------

    def contact_cells(self) -> dict[str, Any]:
        """The cells of a contact with a road user; empty without one."""
        found = self._partner() if self.outcome == Outcome.COLLISION.word and self.drove.any() else None
        if found is None:
            return {}
        step, other = found
        velocities = [self._velocity(step, body) for body in (self.player, other)]
        relative = velocities[1] - velocities[0]
        closing = float(np.hypot(*relative))
        own_kg, other_kg = self.masses_kg[[self.player, other]].tolist()
        angle = impact_angle_rad(self._box(step, self.player), self._box(step, other), *relative.tolist())
        return {
            "closing_speed_mps": closing,
            "ego_delta_v_mps": closing / (1.0 + own_kg / other_kg),
            "other_delta_v_mps": closing / (1.0 + other_kg / own_kg),
            "impact_side": side_of(angle),
        }

    def _partner(self) -> tuple[int, int] | None:
        """The step of the contact, and the body that is nearest in it."""
        step = int(np.flatnonzero(self.drove)[-1])
        present = self.q.bodies.present[step]
        others = [body for body in np.flatnonzero(present).tolist() if body != self.player]
        if not others:
            return None
        own = self._box(step, self.player)
        return step, min(others, key=lambda body: box_distance(own, self._box(step, body)))

    def _box(self, step: int, body: int) -> Box:
        return Box(*(float(getattr(self.q.bodies, name)[step, body]) for name in Box._fields))

    def _velocity(self, step: int, body: int) -> FloatArray:
        bodies = self.q.bodies
        heading = bodies.heading_rad[step, body]
        return np.array([np.cos(heading), np.sin(heading)]) * bodies.speed_mps[step, body]

    # --- how close it came -----------------------------------------------------------------------------------------

    def closeness_cells(self) -> dict[str, Any]:
        """The cells of a game with or without a contact."""
        step_s, ttc = self.q.world.step_s, self._ttc_s
        needed, braking = self._needed_mps2, -self.q.state.acceleration_mps2[self.drove, self.player]
        since = np.flatnonzero(needed > 0.0)
        below = ttc <= at.CONFLICT_TTC_S
        touched = self.outcome == Outcome.COLLISION.word
        return {
            "min_time_headway_s": _least(self._headway_s),
            "min_post_encroachment_time_s": None if math.isinf(self._pet_s) else self._pet_s,
            "needed_braking_mps2": float(needed.max()) if len(needed) else None,
            "used_braking_mps2": max(0.0, float(braking[since[0] :].max())) if len(since) else None,
            "time_exposed_ttc_s": float(np.count_nonzero(below)) * step_s,
            "time_integrated_ttc_s2": float((at.CONFLICT_TTC_S - ttc[below]).sum()) * step_s,
            "time_headway_below_1_s": float(np.count_nonzero(self._headway_s < at.SHORT_HEADWAY_S)) * step_s,
            "near_miss": int(not touched and self._closest <= 1.0),
        }

    @property
    def _closest(self) -> float:
        """The least of the measures of closeness, each over its limit; inf without any."""
        measures = (
            _least(self._ttc_s, math.inf) / at.CONFLICT_TTC_S,
            self._pet_s / at.CONFLICT_PET_S,
            _least(self._headway_s, math.inf) / at.CONFLICT_HEADWAY_S,
        )
        return min(measures)

    def severity(self, cells: Mapping[str, Any]) -> float:
        """The number that orders games."""
        if self.outcome == Outcome.COLLISION.word:
            return CONTACT + min(max(cells.get("ego_delta_v_mps", 0.0), cells.get("other_delta_v_mps", 0.0)), _MOST_MPS)
        if self.outcome == Outcome.RAIL.word:
            speeds = self.q.state.speed_mps[self.drove, self.player]
            return RAIL + (min(float(speeds[-1]), _MOST_MPS) if len(speeds) else 0.0)
        return float(closeness(self._closest)) + (TIMEOUT if self.outcome == Outcome.TIMEOUT.word else 0.0)

    @cached_property
    def _ttc_s(self) -> FloatArray:
        return self.q.time_to_collision_s[self.drove, self.player]

    @cached_property
    def _headway_s(self) -> FloatArray:
        """[T] inf without a road user ahead that goes the same way."""
        q, player = self.q, self.player
        path, world = q.on_path, q.world
        turned = q.bodies.heading_rad - q.state.heading_rad[:, player, None]
        ahead, left = path.ahead_m[:, player], path.left_m[:, player]
        in_way = np.abs(left) < path.half_width_m[:, player] + 0.5 * world.width_m[player]
        leads = q.visible[:, player] & in_way & (ahead > 0.0) & (ahead < SIGHT_M)
        leads &= np.cos(turned) > math.cos(at.LEADER_TURNED_RAD)
        gap = np.maximum(ahead - path.half_length_m[:, player] - 0.5 * world.length_m[player], 0.0)
        nearest = np.where(leads, gap, np.inf).min(-1)
        return (nearest / np.maximum(q.state.speed_mps[:, player], 0.1))[self.drove]

    @cached_property
    def _needed_mps2(self) -> FloatArray:
        actuators = self.q.world.actuators
        most = min(float(actuators.max_braking_mps2[self.player]), actuators.friction * GRAVITY_MPS2)
        own, others, among = self._boxes
        speeds = self.q.bodies.speed_mps[self.drove]
        own_speed = self.q.state.speed_mps[self.drove, self.player]
        return needed_braking_mps2(own, own_speed, others, speeds, among, most, at.NEEDED_WITHIN_S)

    @cached_property
    def _pet_s(self) -> float:
        step_s = self.q.world.step_s
        return float(post_encroachment_s(*self._boxes, at.CROSSING_RAD, step_s, round(at.LONGEST_PET_S / step_s)))

    @cached_property
    def _boxes(self) -> tuple[Box, Box, BoolArray]:
        """The player's boxes [T], all bodies' [T, B], and which of those are others that are there [T, B]."""
        bodies, drove = self.q.bodies, self.drove
        others = Box(*(getattr(bodies, name)[drove] for name in Box._fields))
        own = Box(*(np.ascontiguousarray(each[:, self.player]) for each in others))
        among = bodies.present[drove].copy()
        among[:, self.player] = False
        return own, others, among


def closeness(share: Any) -> Any:
    """From 100 at a share of 0 to 0 at inf: how close a game came, from the least of its measures over their limits."""
    return 100.0 / (1.0 + share)


def side_of(angle_rad: float) -> str:
    """The side of a box that is hit from a direction in its frame: 0 from ahead, counter-clockwise."""
    if abs(angle_rad) <= 0.25 * math.pi:
        return "front"
    if abs(angle_rad) >= 0.75 * math.pi:
        return "rear"
    return "left" if angle_rad > 0.0 else "right"


def _least(values: FloatArray, otherwise: float | None = None) -> Any:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else otherwise
