"""The metrics that say how a player drives: what `realism` compares with published figures of people."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from harness.evaluation.column import SHARE
from harness.evaluation.metrics import Drive, finite, metric
from harness.evaluation.rule_book.course import Stretch, runs
from harness.evaluation.rule_book.thresholds import LANE_CHANGE_M
from harness.game.arrays import BoolArray, FloatArray
from harness.game.meetings import STANDING_MPS

FOLLOWS_S = 3.0
"""Largest gap over own speed at which a player follows its leader."""
_FOLLOWS_LEAST_S = 15.0
"""From this time on behind the same vehicle a player follows it: a usual criterion of studies."""
_MOVING_MPS = 5.0
_BEGUN, _ENDED = 0.05, 0.95  # of the way from lane to lane
_KEEPS_LEAST_S = 2.0  # of lane keeping, in all
_WHEEL_RATIO = 15.0  # of a steering wheel's angle to that of the road wheels
_REVERSAL_RAD = np.radians(3.0) / _WHEEL_RATIO


def _in_lane(drive: Drive) -> tuple[FloatArray, FloatArray]:
    """[N] the centre of the nearest lane in each step, and the place of the player, both from the route's line."""
    return drive.game.while_driving(drive.game.lane_centre_m, drive.player), drive.of("lateral_offset_m")


def lane_changes(drive: Drive) -> list[Stretch]:
    """The changes of lane that a player began and ended while it drove, from the last step on the centre of the old
    lane to the first on that of the new one. The first 5 % and the last 5 % of the way are those of keeping a lane."""
    found, (centre_m, place_m) = list[Stretch](), _in_lane(drive)
    moved_m = np.diff(centre_m, prepend=centre_m[:1])
    line_m = np.where(np.abs(moved_m) <= LANE_CHANGE_M, -moved_m, 0.0).cumsum()  # where a lane opens, the line moves
    centre_m, place_m = centre_m + line_m, place_m + line_m
    for step in np.flatnonzero(np.abs(np.diff(centre_m)) > LANE_CHANGE_M).tolist():
        old_m, new_m = centre_m[step], centre_m[step + 1]
        share = (place_m - old_m) / (new_m - old_m)
        before, behind = np.flatnonzero(share[: step + 1] <= _BEGUN), np.flatnonzero(share[step + 1 :] >= _ENDED)
        if len(before) and len(behind):
            found.append((int(before[-1]), step + 1 + int(behind[0])))
    return found


@metric("conduct", meaning="Distance along the route.")
def distance_m(drive: Drive) -> float:
    return float(drive.of("advanced_m").sum())


@metric("conduct", meaning=f"Mean speed while it moves, faster than {STANDING_MPS:g} m/s.")
def moving_speed_mps(drive: Drive) -> float | None:
    speed_mps = drive.of("speed_mps")
    return finite(speed_mps[speed_mps > STANDING_MPS], np.mean)


@metric(
    "conduct",
    meaning="Mean duration of the changes of lane, from 5 % to 95 % of the way between the centres of the lanes.",
)
def lane_change_s(drive: Drive) -> float | None:
    return finite(np.array([last - first for first, last in lane_changes(drive)]) * drive.step_s, np.mean)


@metric(
    "conduct",
    meaning="Standard deviation of the distance from the centre of the nearest lane, outside changes of lane.",
    source="Verster and Roth 2011, SDLP",
)
def lateral_wander_m(drive: Drive) -> float | None:
    centre_m, place_m = _in_lane(drive)
    keeps = np.isfinite(centre_m)
    for first, last in lane_changes(drive):
        keeps[first : last + 1] = False
    if keeps.sum() * drive.step_s < _KEEPS_LEAST_S:
        return None
    return finite((place_m - centre_m)[keeps], np.std)


@metric(
    "conduct",
    meaning=f"Median gap over own speed while following: behind the same vehicle, within {FOLLOWS_S:g} s, for more "
    f"than {_FOLLOWS_LEAST_S:g} s.",
)
def following_gap_s(drive: Drive) -> float | None:
    gaps_s = drive.of("time_gap_s")
    behind = (gaps_s <= FOLLOWS_S) & (drive.of("speed_mps") >= _MOVING_MPS)
    leader = np.where(behind, drive.of("leader"), -1)
    since = np.arange(len(leader)) - np.maximum.accumulate(
        np.where(np.diff(leader, prepend=-1), np.arange(len(leader)), 0)
    )
    follows = behind & (since * drive.step_s > _FOLLOWS_LEAST_S)
    return finite(gaps_s[follows], np.median)


@metric(
    "conduct",
    meaning=f"Mean of speed minus speed limit where no leader is within {FOLLOWS_S:g} s, and no bend, signal, sign or "
    "priority ahead asks for less than the limit; below 0 under the limit.",
)
def free_over_limit_mps(drive: Drive) -> float | None:
    free = (drive.of("time_gap_s") > FOLLOWS_S) & (drive.of("due_mps") >= drive.of("speed_limit_mps"))
    return finite((drive.of("speed_mps") - drive.of("speed_limit_mps"))[free], np.mean)


@metric("conduct", meaning="Greatest change of the acceleration along the heading per second, while it moves.")
def max_jerk_mps3(drive: Drive) -> float | None:
    return finite(np.abs(drive.of("jerk_mps3"))[drive.of("speed_mps") > 0.0], np.max)


@metric(
    "conduct",
    meaning="Changes of the direction of steering per second, of at least 3 degrees of a steering wheel with a ratio "
    "of 15; empty where SUMO drives.",
    source="Markkula and Engström 2006, without its low-pass filter",
)
def steering_reversals_per_s(drive: Drive) -> float | None:
    if not drive.game.steers[drive.player]:
        return None
    wheel_rad = drive.game.while_driving(drive.game.quantities.state.steering_rad, drive.player)
    return len(list(_turning_points(wheel_rad))) / (len(wheel_rad) * drive.step_s) if len(wheel_rad) else None


def _turning_points(wheel_rad: FloatArray) -> Iterator[int]:
    """The steps from which the wheel goes back by at least `_REVERSAL_RAD`."""
    extreme, sense = 0, 0.0
    for step, angle in enumerate(wheel_rad.tolist()):
        way = angle - float(wheel_rad[extreme])
        if sense * way > 0.0:
            extreme = step
        elif abs(way) >= _REVERSAL_RAD:
            if sense:
                yield extreme
            extreme, sense = step, float(np.sign(way))


@metric("conduct", meaning="Share of the time during which the player's attention has lapsed.", unit=SHARE)
def looks_away_share(drive: Drive) -> float | None:
    return finite(_lapsed(drive).astype(float), np.mean)


@metric("conduct", meaning="Longest lapse of attention; empty without one.")
def longest_lapse_s(drive: Drive) -> float | None:
    lengths = [last - first + 1 for first, last in runs(_lapsed(drive))]
    return max(lengths) * drive.step_s if lengths else None


@metric(
    "conduct",
    meaning="Time at the end of the player's game in which it made no decision, because its attention had lapsed.",
)
def undecided_at_end_s(drive: Drive) -> float | None:
    lapsed = _lapsed(drive)
    decided, steps = np.flatnonzero(~lapsed), len(lapsed)
    return (steps - 1 - int(decided[-1]) if len(decided) else steps) * drive.step_s if steps else None


def _lapsed(drive: Drive) -> BoolArray:
    return drive.game.while_driving(drive.game.quantities.state.lapsed, drive.player)
