"""The cause of one failure of the ego, from the trace of the game.

The rules, in order:

1. The other is the road user that the ego touches. Where the ego leaves the road, it is the player with which it was on
   a collision course last, if that was within `SINCE_S` of the end.
2. What the other did begins when its body crosses a mark of the ego's lane, if that was within `SINCE_S` of the end: it
   cuts in, drifts in (in a lapse of attention), crosses, or comes towards the ego; or the ego changes into its lane. A
   body that was in the ego's lane before brakes, stands or drives ahead, or hits the ego from behind: that begins with
   the last stretch at a time to collision of at most `DANGER_TTC_S`.
3. A rule of the road that the other or the ego broke in that time is named besides.
4. The ego saw it if in some step from then to the end it was not in a lapse of attention and nothing hid the other.
5. The ego reacted if it braked or steered away, from `BEFORE_S` before then on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.evaluation.causes import thresholds as at
from harness.evaluation.causes.rule_breaks import TURNS_ACROSS, WRONG_WAY, rule_broken
from harness.evaluation.causes.way import InWay, in_way
from harness.evaluation.manoeuvres.pairs import NO_REACTION
from harness.evaluation.severity.measures import Kind
from harness.evaluation.trace_quantities import body_names, drove_in, obstacle_names, quantities_of
from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box, box_distance, time_to_contact
from harness.game.outcome import Outcome
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.route_coordinates import PATH_M
from harness.game.world import World

_HERE = int(np.flatnonzero(PATH_M == 0.0)[0])
_WALKS, _RIDES, _DRIVES = "walks", "rides", "drives"
_MOVES = {"pedestrian": _WALKS, "wheelchair": _WALKS, "bicycle": _RIDES, "scooter": _RIDES}  # by class


@dataclass(frozen=True, kw_only=True)
class Cause:
    """Why the ego failed in one game."""

    other: str
    """The road user that was involved, by its name in the trace; empty if none was."""
    deed: str
    """What it did."""
    time_s: float
    """When that began."""
    time_left_s: float
    """From then to the end of the ego's game."""
    ego_saw: bool | None
    """None where no other was involved."""
    hidden_until_s: float
    """Time before the end at which the other came into sight, if something hid it when its deed began; else NaN."""
    reaction: str
    """`brakes`, `swerves`, `brakes and swerves` or `no reaction`."""
    braking_mps2: float
    """Strongest braking of the ego in that time."""
    ego_broke: str
    """The rule of the road that the ego broke; empty if none."""


@dataclass(frozen=True, kw_only=True)
class _Game:
    q: Quantities
    last: int
    """The step in which the ego's game ended."""
    outcome: str
    names: tuple[str, ...]
    """Of the bodies."""
    kinds: tuple[Kind, ...]

    @property
    def step_s(self) -> float:
        return self.q.world.step_s

    def steps(self, seconds: float) -> int:
        return round(seconds / self.step_s)

    def box(self, step: int, body: int) -> Box:
        """A body's box."""
        return Box(*(float(getattr(self.q.bodies, name)[step, body]) for name in Box._fields))

    def velocity(self, step: int, body: int) -> FloatArray:
        """A body's velocity (m/s)."""
        heading = self.q.bodies.heading_rad[step, body]
        return self.q.bodies.speed_mps[step, body] * np.array([math.cos(heading), math.sin(heading)])

    def ttc_s(self, step: int, body: int) -> float:
        """The ego's time to collision with a body."""
        relative = self.velocity(step, body) - self.velocity(step, EGO)
        return time_to_contact(self.box(step, EGO), self.box(step, body), *relative.tolist())


def cause_of(trace: pd.DataFrame, world: World, kinds: Mapping[str, Kind]) -> Cause | None:
    """The cause of the ego's failure in one game; None if there is no ego, or it reached its goal.

    `kinds` are the vehicle types in the trace, by default SUMO's.
    """
    game = _game(trace, world, kinds)
    if game is None or game.outcome in (Outcome.GOAL.word, Outcome.RUNNING.word):
        return None
    other = _other(game)
    if other is None:
        return _of_the_ego_alone(game)
    way = in_way(game.q, other)
    begin, deed = _deed(game, other, way)
    broke = {}
    if len(world.right_of_way.stop_lines.player) or len(world.right_of_way.conflicts.player):
        sizes = {name: (kind.length_m, kind.width_m) for name, kind in kinds.items()}
        players = [EGO] + ([other] if other < len(world.roles) else [])
        broke = rule_broken(trace, world, sizes, players, game.last)
    subject = _subject(game, other)
    seen = _seen(game, other, begin)
    reaction, braking = _reaction(game, begin)
    return Cause(
        other=game.names[other],
        deed=subject + _with_rule(broke.get(other, ""), deed),
        time_s=round(begin * game.step_s, 6),
        time_left_s=round((game.last - begin) * game.step_s, 6),
        ego_saw=bool(seen.any()),
        hidden_until_s=_hidden_until_s(game, other, begin),
        reaction=reaction,
        braking_mps2=braking,
        ego_broke=broke.get(EGO, ""),
    )


def _subject(game: _Game, other: int) -> str:
    """Words for a road user that is not a person of the game; empty for a person."""
    if other < len(game.q.world.roles):
        return ""
    return "an obstacle: " if game.names[other] in obstacle_names(game.q.world) else "background traffic: "


def _with_rule(broken: str, deed: str) -> str:
    """What a road user did, with the rule that it broke. Some rules say it all."""
    if broken in (TURNS_ACROSS, WRONG_WAY):
        return broken
    return f"{broken} and {deed}" if broken else deed


def _game(trace: pd.DataFrame, world: World, kinds: Mapping[str, Kind]) -> _Game | None:
    drove = drove_in(trace, world.roles)[:, EGO]
    if not drove.any():
        return None
    types = {str(row.player): str(row.vehicle_type) for row in trace.drop_duplicates("player").itertuples()}
    by_name = {name: kinds.get(kind, Kind()) for name, kind in types.items()}
    names = tuple(body_names(trace, world))
    ends = trace.loc[(trace["player"] == world.roles[EGO]) & (trace["outcome"] != ""), "outcome"]
    return _Game(
        q=quantities_of(trace, world, {name: (kind.length_m, kind.width_m) for name, kind in by_name.items()}),
        last=int(np.flatnonzero(drove)[-1]),
        outcome=str(ends.iloc[0]) if len(ends) else Outcome.RUNNING.word,
        names=names,
        kinds=tuple(by_name.get(name, Kind()) for name in names),
    )


def _other(game: _Game) -> int | None:
    """The road user that was involved; None if there was none."""
    present, last = game.q.bodies.present, game.last
    if game.outcome == Outcome.COLLISION.word:
        others = [body for body in np.flatnonzero(present[last]).tolist() if body != EGO]
        own = game.box(last, EGO)
        return min(others, key=lambda body: box_distance(own, game.box(last, body)), default=None)
    if game.outcome != Outcome.RAIL.word:
        return None
    for step in range(last, max(last - game.steps(at.SINCE_S), 0) - 1, -1):
        players = [body for body in range(1, len(game.q.world.roles)) if present[step, body]]
        soonest = min(players, key=lambda body: game.ttc_s(step, body), default=None)
        if soonest is not None and game.ttc_s(step, soonest) <= at.DANGER_TTC_S:
            return soonest
    return None


def _of_the_ego_alone(game: _Game) -> Cause:
    timeout = game.outcome == Outcome.TIMEOUT.word
    deed = "the ego does not reach its goal in time" if timeout else "the ego leaves the road with no road user near"
    reaction, braking = _reaction(game, game.last)
    end_s = round(game.last * game.step_s, 6)
    return Cause(
        other="",
        deed=deed,
        time_s=end_s,
        time_left_s=0.0,
        ego_saw=None,
        hidden_until_s=math.nan,
        reaction=reaction,
        braking_mps2=braking,
        ego_broke="",
    )


def _deed(game: _Game, other: int, way: InWay) -> tuple[int, str]:
    """The step in which what the other did began, and what it was."""
    last = game.last
    first = max(last - game.steps(at.SINCE_S), 0)
    outside = np.flatnonzero(~way.inside[first:last])
    if not way.inside[last]:
        return _danger(game, other), "the ego leaves its lane towards it"
    if len(outside):
        step = first + int(outside[-1]) + 1
        side = "left" if way.left_m[step - 1] > 0.0 else "right"
        if abs(way.lane_m[step] - way.lane_m[step - 1]) > 1.0:
            return step, f"the ego changes into its lane, to the {'right' if side == 'right' else 'left'}"
        return step, _enters(game, other, step, side)
    return _danger(game, other), _in_lane(game, other, way)


def _enters(game: _Game, other: int, step: int, side: str) -> str:
    """How a body crosses the mark of the ego's lane."""
    moves = _moves(game, other)
    if moves != _DRIVES:
        return f"{moves} into the ego's lane from the {side}"
    turned = game.q.bodies.heading_rad[step, other] - game.q.state.heading_rad[step, EGO]
    angle = abs((turned + math.pi) % (2.0 * math.pi) - math.pi)
    if angle > at.ONCOMING_RAD:
        return "comes towards the ego into its lane"
    if angle > at.CROSSES_RAD:
        return f"crosses the ego's way from the {side}"
    if other < len(game.q.world.roles) and game.q.state.lapsed[step, other]:
        return f"drifts into the ego's lane from the {side}, inattentive"
    return f"cuts in from the {side}"


def _in_lane(game: _Game, other: int, way: InWay) -> str:
    """What a body does that has been in the ego's lane."""
    q, last = game.q, game.last
    turned = q.bodies.heading_rad[last, other] - q.state.heading_rad[last, EGO]
    if math.cos(turned) < math.cos(at.ONCOMING_RAD):
        return "comes towards the ego in its lane"
    if way.ahead_m[last] < 0.0:
        return "hits the ego from behind"
    if q.bodies.speed_mps[last, other] < at.STANDS_MPS:
        return "stands in the ego's lane"
    moves = _moves(game, other)
    since = max(last - game.steps(at.SINCE_S), 0)
    speeds = q.bodies.speed_mps[since : last + 1, other]
    braking = -np.diff(speeds) / game.step_s
    if moves != _WALKS and len(braking) and braking.max() >= at.BRAKES_MPS2:
        moves = "brakes"
    return f"{moves} ahead of the ego"


def _moves(game: _Game, other: int) -> str:
    """The verb for how a body of its class goes on."""
    return _MOVES.get(game.kinds[other].vehicle_class, _DRIVES)


def _danger(game: _Game, other: int) -> int:
    """The first step of the last stretch, up to the end, at a time to collision of at most `DANGER_TTC_S`."""
    step = game.last
    while step > 0 and game.q.bodies.present[step - 1, other] and game.ttc_s(step - 1, other) <= at.DANGER_TTC_S:
        step -= 1
    return step


def _reaction(game: _Game, begin: int) -> tuple[str, float]:
    """What the ego did about it, and its strongest braking (m/s^2)."""
    steps = slice(max(begin - game.steps(at.BEFORE_S), 1), game.last + 1)
    braking = max(0.0, float((-game.q.state.acceleration_mps2[steps, EGO]).max(initial=0.0)))
    sideways = float(np.abs(game.q.lateral_acceleration_mps2[steps, EGO]).max(initial=0.0))
    turned = game.q.state.heading_rad[steps, EGO] - game.q.path_heading_rad[steps, EGO, _HERE]
    swerves = sideways >= at.SWERVES_MPS2 and float(np.cos(turned).min(initial=1.0)) <= math.cos(at.SWERVES_RAD)
    did = [word for word, done in (("brakes", braking >= at.BRAKES_MPS2), ("swerves", swerves)) if done]
    return " and ".join(did) or NO_REACTION, braking


def _seen(game: _Game, other: int, begin: int) -> BoolArray:
    """[N] whether the ego looked and could see a body, from a step to the end."""
    lapsed = game.q.state.lapsed[begin : game.last + 1, EGO]
    hidden = game.q.hidden[begin : game.last + 1, EGO, other]
    return np.asarray(~lapsed & ~hidden & (_distances(game, other, begin) <= at.SEEN_M))


def _hidden_until_s(game: _Game, other: int, begin: int) -> float:
    hidden = game.q.hidden[begin : game.last + 1, EGO, other]
    if not hidden[0]:
        return math.nan
    free = np.flatnonzero(~hidden)
    return round((len(hidden) - 1 - int(free[0])) * game.step_s, 6) if len(free) else 0.0


def _distances(game: _Game, other: int, begin: int) -> FloatArray:
    """[N] from the ego to a body, from a step to the end."""
    bodies, steps = game.q.bodies, slice(begin, game.last + 1)
    return np.hypot(
        bodies.x_m[steps, other] - bodies.x_m[steps, EGO], bodies.y_m[steps, other] - bodies.y_m[steps, EGO]
    )
