"""A rule-based driver: driver-assistance software of production cars, or a reference driver of a regulation."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from harness.config.scene import Name
from harness.config.toml_reading import Document
from harness.config.tunable import Adjustable, Tunable


class Cruise(Document):
    """Adaptive cruise control: a constant time gap to the leading car, and the speed limit if there is none."""

    speed_share: float = Field(1.0, ge=0.3, le=1.5)
    """Target speed, as a share of the limit."""
    time_gap_s: float = Field(1.5, ge=0.8, le=4.0)
    """Target time gap. ISO 15622 (2018): at least 0.8 s; a gap between 1.5 and 2.2 s must be available."""
    standstill_m: float = Field(3.0, ge=1.0, le=10.0)
    """Target gap behind a stopped car."""
    gap_gain_per_s: float = Field(0.4, ge=0.05, le=2.0)
    """lambda of the control law: how fast an error in the gap is corrected."""
    speed_response_s: float = Field(2.0, ge=0.5, le=10.0)
    """Time in which an error in the speed is corrected on a free road."""
    max_acceleration_mps2: float = Field(2.0, ge=0.5, le=4.0)
    """Greatest acceleration. ISO 15622: at most 2 m/s^2 above 20 m/s, 4 m/s^2 below 5 m/s."""
    max_braking_mps2: float = Field(3.5, ge=1.0, le=5.0)
    """Greatest braking. ISO 15622: at most 3.5 m/s^2 above 20 m/s, 5 m/s^2 below 5 m/s."""
    max_jerk_mps3: float = Field(5.0, ge=1.0, le=50.0)
    """Greatest jerk. ISO 15622: at most 2.5 m/s^3 above 20 m/s, 5 m/s^3 below 5 m/s."""
    max_lateral_mps2: float = Field(2.0, ge=0.5, le=4.0)
    """Greatest lateral acceleration in a curve; the car slows down to stay below it."""
    anticipates_s: float = Field(1.5, ge=0.0, le=4.0)
    """A car that will be in the ego's path within this time, at its present lateral speed, is already followed."""


class LaneKeeping(Document):
    """Steering along the lane: the Stanley controller with the comfort limits of UN R79."""

    heading_gain: float = Field(0.5, ge=0.1, le=1.0)
    """Steering angle per angle between car and path."""
    offset_gain_per_s: float = Field(0.3, ge=0.05, le=2.0)
    """Steering angle per offset from the path, multiplied by the speed."""
    softening_mps: float = Field(1.0, ge=0.1, le=5.0)
    """Added to the speed, so that steering stays smooth at walking pace."""
    max_lateral_mps2: float = Field(3.0, ge=1.0, le=6.0)
    """Greatest lateral acceleration. UN R79, 5.6.2.1.3: at most 3 m/s^2."""
    max_lateral_jerk_mps3: float = Field(5.0, ge=1.0, le=20.0)
    """Greatest lateral jerk. UN R79, 5.6.2.1.3: at most 5 m/s^3."""


class EmergencyBraking(Document):
    """Automatic emergency braking for a car ahead in the ego's path (UN R152, car to car, 5.2.1)."""

    brakes_ttc_s: float = Field(1.4, ge=0.5, le=3.0)
    """Time to collision at which emergency braking starts."""
    warns_before_s: float = Field(0.8, ge=0.0, le=2.0)
    """Time between warning and emergency braking. UN R152, 5.2.1.1: at least 0.8 s. There is no person to warn, so the
    warning only slows the car by `warning_braking_mps2`."""
    warning_braking_mps2: float = Field(1.0, ge=0.0, le=4.0)
    """Braking during the warning: a haptic warning that also prepares the brakes."""
    braking_mps2: float = Field(9.0, ge=5.0, le=12.0)
    """Emergency braking, within the limits of the car. UN R152, 5.2.1.2: at least 5 m/s^2."""
    build_up_mps3: float = Field(30.0, ge=5.0, le=200.0)
    """Jerk while the braking increases."""


class ReferenceReaction(Document):
    """Parameters common to the reference drivers: how a person starts to brake (UN R157, Annex 4, Appendix 3)."""

    reaction_s: float = Field(0.75, ge=0.0, le=3.0)
    """Time from the perception of the risk to the start of braking (table 1)."""
    jerk_mps3: float = Field(12.65, ge=1.0, le=50.0)
    """Jerk while the braking increases: 0.774 g in 0.6 s (table 1)."""
    full_braking_g: float = Field(0.774, ge=0.1, le=1.2)
    """Full braking (table 1)."""


class CarefulAndCompetent(ReferenceReaction):
    """The careful and competent human driver of UN R157 (Annex 4, Appendix 3: performance model 1)."""

    wander_m: float = Field(0.375, ge=0.0, le=2.0)
    """A car whose centre is farther than this from its lane's centre may be leaving the lane."""
    perception_s: float = Field(0.4, ge=0.0, le=2.0)
    """Time to perceive that the car may be leaving its lane."""
    ttc_s: float = Field(2.0, ge=0.1, le=10.0)
    """Greatest time to collision at which such a car is a danger."""
    coasting_mps2: float = Field(0.4, ge=0.0, le=2.0)
    """Deceleration while the foot moves from one pedal to the other (public program of the EU Joint Research
    Centre)."""
    wrapped_braking_g: float = Field(0.85, ge=0.1, le=1.2)
    """Full braking once the other car is entirely in front of the ego, when emergency braking assists (table 1, after
    R152)."""
    wrapped_m: float = Field(0.1, ge=0.0, le=1.0)
    """Greatest lateral offset between the centre lines of the two cars for that."""
    lane_width_m: float = Field(3.2, ge=2.0, le=5.0)
    """Assumed width of the lanes beside the ego's lane: observations have the positions of other cars, not their
    lanes."""


class Rss(ReferenceReaction):
    """Responsibility-sensitive safety (Shalev-Shwartz et al. 2017), parameters as in Mattas et al. 2022."""

    acceleration_mps2: float = Field(3.0, ge=0.0, le=6.0)
    """Greatest acceleration of the ego during the reaction time."""
    braking_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """Least braking of the ego after the reaction time."""
    other_braking_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """Greatest braking of the leading car."""
    waiting_mps: float = Field(0.1, ge=0.0, le=1.0)
    """Speed below which a road user that has to yield to the ego waits, and an oncoming one counts as standing."""
    lateral_mps2: float = Field(1.0, ge=0.1, le=5.0)
    """Lateral acceleration of other cars, towards the ego and away from it."""
    lateral_margin_m: float = Field(0.3, ge=0.0, le=2.0)
    """mu: lateral distance that is always kept."""


class FuzzySafety(ReferenceReaction):
    """The fuzzy safety model (Mattas et al. 2020; performance model 2 of UN R157)."""

    comfortable_mps2: float = Field(4.0, ge=1.0, le=12.0)
    """Comfortable braking of a proactive driver."""
    hardest_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """Hardest braking, in danger."""
    other_braking_mps2: float = Field(7.0, ge=1.0, le=12.0)
    """Greatest braking of the leading car."""
    margin_m: float = Field(2.0, ge=0.0, le=10.0)
    """Distance between the cars after both have stopped; it is added to the safe distance once more."""
    lateral_margin_s: float = Field(0.1, ge=0.0, le=2.0)
    """The other car's time to reach the ego's path must exceed the ego's time to pass by at least this."""

    @model_validator(mode="after")
    def _braking_increases(self) -> FuzzySafety:
        if self.hardest_mps2 <= self.comfortable_mps2:
            raise ValueError("hardest_mps2 must exceed comfortable_mps2: the fuzzy sets lie between them")
        return self


_DEFAULT_TUNABLES = (
    Tunable("cruise.speed_share", 0.7, 1.0),
    Tunable("cruise.time_gap_s", 0.8, 2.5),
    Tunable("cruise.standstill_m", 2.0, 6.0),
    Tunable("cruise.gap_gain_per_s", 0.1, 1.0),
    Tunable("cruise.max_braking_mps2", 2.0, 5.0),
    Tunable("cruise.anticipates_s", 0.0, 4.0),
    Tunable("emergency_braking.brakes_ttc_s", 0.8, 2.5),
    Tunable("emergency_braking.warns_before_s", 0.8, 2.0),
    Tunable("emergency_braking.warning_braking_mps2", 0.0, 4.0),
)
"""Tunable parameters of a driver whose document has no table `tunable`."""
REACTIONS = ("emergency_braking", "careful_and_competent", "rss", "fuzzy")


class Rules(Adjustable):
    """A rule-based driver. At most one table defines its reaction to danger; without one, it has cruise control only.

    In `tunable`, its parameters are named `<table>.<key>`. Without `tunable`, the parameters of driver assistance that
    a manufacturer may choose are tunable, and a reference driver has no tunable parameters: a tuned one would no longer
    be a reference.
    """

    parameter_table: ClassVar[str] = ""  # its parameters are in several tables

    kind: Literal["rules"]
    """The kind of driver, which determines the other keys."""
    name: Name
    """The name of these rules in reports."""
    description: str = Field(min_length=10, max_length=2000)
    """The driver in one sentence."""
    cruise: Cruise = Cruise()
    lane_keeping: LaneKeeping = LaneKeeping()
    emergency_braking: EmergencyBraking | None = None
    careful_and_competent: CarefulAndCompetent | None = None
    rss: Rss | None = None
    fuzzy: FuzzySafety | None = None

    @model_validator(mode="after")
    def _one_reaction(self) -> Rules:
        given = [name for name in REACTIONS if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"give only one of the tables {', '.join(given)}: a driver has one reaction to danger")
        return self

    @property
    def searched(self) -> tuple[Tunable, ...]:
        if self.tunable is not None:
            return self.declared
        if any(getattr(self, name) is not None for name in REACTIONS[1:]):
            return ()
        values = self.numbers
        tunables = (each for each in _DEFAULT_TUNABLES if each.key in values)
        return tuple(Tunable(key, min(low, values[key]), max(high, values[key])) for key, low, high in tunables)

    @property
    def numbers(self) -> dict[str, float]:
        """All parameters, by `<table>.<key>`."""
        tables = {name: getattr(self, name) for name in ("cruise", "lane_keeping", *REACTIONS)}
        return {
            f"{name}.{key}": value
            for name, table in tables.items()
            if table is not None
            for key, value in table.model_dump().items()
        }

    def _set(self, document: dict[str, Any], key: str, value: float) -> None:
        table, name = key.split(".")
        document[table][name] = value
