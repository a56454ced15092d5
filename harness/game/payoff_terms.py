"""The terms of equation 1: the quantities that a persona may weigh, and the function that each applies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from math import nan

from harness.game.outcome import Outcome

GROUPS = ("safety", "operational", "human")
FUZZY_QUANTITIES: Mapping[str, str] = {
    "speed_over_limit": "speed over the limit, as a share of it; negative below",
    "speed_mps": "speed",
    "time_gap_s": "time gap to the vehicle ahead",
    "gap_s": "time between the passages of the car and of another vehicle where their ways meet; infinite without one",
    "clearance_m": "distance to the nearest surface, rail or vehicle",
    "lane_offset_m": "distance from the centre of the nearest lane",
    "lane_end_m": "distance until the lane the car is in ends; infinite if it goes on",
    "goal_m": "distance to the goal, along the route",
}
"""The quantities that a fuzzy term can use, with their descriptions."""
NEARNESS = ("time_gap_s", "gap_s", "clearance_m")  # the fuzzy quantities that are 0 at contact


class Form(IntEnum):
    """The function that a term applies to its quantity."""

    BELOW = 0  # 0 at the parameter and above, linear to -1 at zero
    OVER = 1  # minus the positive part
    UNDER = 2  # the negative part
    LESS = 3  # minus the quantity
    LESS_SQUARED = 4  # minus the square, in units of 10 m/s2 or 10 m/s3
    PER_100 = 5  # a hundredth of the quantity
    GAINED = 6  # 1 if equal to the parameter
    LOST = 7  # -1 if equal to the parameter
    ALWAYS = 8  # -1
    FROM = 9  # -1 at the parameter and above


@dataclass(frozen=True, kw_only=True)
class Term:
    """A named term of equation 1.

    `quantity` is the name of its quantity [G, P] in `Quantities`. `per_second` terms are rates and are multiplied by
    the step length. The other terms are events and count in the step in which they occur.
    """

    group: str
    meaning: str
    quantity: str
    form: Form
    per_second: bool = True
    parameter: str = ""
    """The name of the form's parameter, if a persona sets it: a limit in the quantity's unit."""
    outcome: Outcome = Outcome.RUNNING
    """The form's parameter, if it is an outcome."""
    example: tuple[str, float] = ("", nan)
    """Of a term without parameter: a moment in words and the quantity in it, from which profiles compute its worth."""


def _ends(group: str, meaning: str, form: Form, outcome: Outcome) -> Term:
    return Term(
        group=group,
        meaning=f"{meaning}, once",
        quantity="state.outcome",
        form=form,
        per_second=False,
        outcome=outcome,
        example=("once", float(outcome)),
    )


_safety = partial(Term, group="safety")
_operational = partial(Term, group="operational")
_human = partial(Term, group="human")


def _below(meaning: str, quantity: str, parameter: str, *, per_second: bool = True) -> Term:
    return _safety(meaning=meaning, quantity=quantity, form=Form.BELOW, parameter=parameter, per_second=per_second)


TERMS: Mapping[str, Term] = {
    "collision": _ends("safety", "touching a vehicle or person", Form.LOST, Outcome.COLLISION),
    "rail": _ends("safety", "touching the edge of the road", Form.LOST, Outcome.RAIL),
    "clearance": _below("nearness to the nearest surface, rail or vehicle", "clearance_m", "within_m"),
    "vehicle_clearance": _below("nearness to the nearest vehicle", "vehicle_clearance_m", "within_m"),
    "time_gap": _below("following closer than a time gap", "time_gap_s", "within_s"),
    "time_to_collision": _below("being on a course to contact sooner than this", "time_to_collision_s", "within_s"),
    "speed_over_limit": _safety(
        meaning="speed over the limit, or over what a signal, a sign or priority permits, as a share of the limit",
        quantity="speed_over_permitted",
        form=Form.OVER,
        example=("at 10 % over", 0.1),
    ),
    "red_light": _safety(
        meaning="passing a stop line on red, once, if the signal is red for at least this long",
        quantity="rules.passed_red_s",
        form=Form.FROM,
        per_second=False,
        parameter="after_s",
    ),
    "stop_sign": _safety(
        meaning="passing a stop sign at this speed or faster, once",
        quantity="rules.passed_stop_sign_mps",
        form=Form.FROM,
        per_second=False,
        parameter="from_mps",
    ),
    "wrong_way": _safety(
        meaning="being among oncoming lanes",
        quantity="along.wrong_way",
        form=Form.LESS,
        example=("on the wrong side", 1.0),
    ),
    "yield": _below(
        "entering the way of a vehicle with priority that is there sooner than this, once",
        "entered_before_s",
        "within_s",
        per_second=False,
    ),
    "gap": _below("passing a crossing or a merge closer in time to another vehicle than this", "gap_s", "within_s"),
    "lane_end": _below("being in a lane that ends sooner than this", "lane_end_m", "within_m"),
    "goal": _ends("operational", "reaching the goal", Form.GAINED, Outcome.GOAL),
    "timeout": _ends("operational", "not reaching the goal in time", Form.LOST, Outcome.TIMEOUT),
    "progress": _operational(
        meaning="way along the route, per 100 m",
        quantity="advanced_m",
        form=Form.PER_100,
        per_second=False,
        example=("for 100 m", 100.0),
    ),
    "speed_under_limit": _operational(
        meaning="speed under the limit, or under what a signal, a sign or priority permits, as a share of the limit",
        quantity="speed_over_permitted",
        form=Form.UNDER,
        example=("at 10 % under", -0.1),
    ),
    "lane_offset": _operational(
        meaning="distance from the nearest lane's centre, m",
        quantity="lane_offset_m",
        form=Form.LESS,
        example=("at 1 m", 1.0),
    ),
    "acceleration": _operational(
        meaning="squared acceleration or braking, as a share of 10 m/s2",
        quantity="state.acceleration_mps2",
        form=Form.LESS_SQUARED,
        example=("at 5 m/s²", 5.0),
    ),
    "jerk": _operational(
        meaning="squared change of acceleration or braking per second, as a share of 10 m/s3",
        quantity="jerk_mps3",
        form=Form.LESS_SQUARED,
        example=("at 5 m/s³", 5.0),
    ),
    "lateral_acceleration": _operational(
        meaning="squared lateral acceleration, as a share of 10 m/s2",
        quantity="lateral_acceleration_mps2",
        form=Form.LESS_SQUARED,
        example=("at 3 m/s²", 3.0),
    ),
    "on_carriageway": _safety(
        meaning="being on the carriageway, on foot",
        quantity="on_carriageway",
        form=Form.LESS,
        example=("on the carriageway", 1.0),
    ),
    "waiting": _human(meaning="standing still", quantity="stands", form=Form.LESS, example=("standing", 1.0)),
    "time_pressure": _human(
        meaning="every second on the way", quantity="state.speed_mps", form=Form.ALWAYS, example=("always", 0.0)
    ),
}
