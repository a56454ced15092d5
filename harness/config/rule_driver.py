"""A driver by rules: driver-assistance software as it is in cars, or a reference driver of a regulation."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from harness.config.scene import Name
from harness.config.toml_reading import Document
from harness.config.tunable import Adjustable, Tunable


class Cruise(Document):
    """Adaptive cruise control: a constant time gap to who leads, the speed limit where nobody does."""

    speed_share: float = Field(1.0, ge=0.3, le=1.5)
    """Speed aimed at, as a share of the limit."""
    time_gap_s: float = Field(1.5, ge=0.8, le=4.0)
    """Gap aimed at, as a time. ISO 15622 (2018): never less than 0.8 s; one of 1.5 to 2.2 s must be offered."""
    standstill_m: float = Field(3.0, ge=1.0, le=10.0)
    """Gap aimed at behind someone who stands."""
    gap_gain_per_s: float = Field(0.4, ge=0.05, le=2.0)
    """lambda of the law: how fast an error of the gap is worked off."""
    speed_response_s: float = Field(2.0, ge=0.5, le=10.0)
    """Time in which an error of the speed is worked off on a free road."""
    max_acceleration_mps2: float = Field(2.0, ge=0.5, le=4.0)
    """ISO 15622: at most 2 m/s^2 above 20 m/s, 4 m/s^2 below 5 m/s."""
    max_braking_mps2: float = Field(3.5, ge=1.0, le=5.0)
    """ISO 15622: at most 3.5 m/s^2 above 20 m/s, 5 m/s^2 below 5 m/s."""
    max_jerk_mps3: float = Field(5.0, ge=1.0, le=50.0)
    """ISO 15622: at most 2.5 m/s^3 above 20 m/s, 5 m/s^3 below 5 m/s."""
    max_lateral_mps2: float = Field(2.0, ge=0.5, le=4.0)
    """It slows for a curve so that the lateral acceleration stays below this."""
    anticipates_s: float = Field(1.5, ge=0.0, le=4.0)
    """Who will be in the way within this time, at their speed across the road, is followed already."""


class LaneKeeping(Document):
    """Steering along the lane: Stanley's law, with the comfort limits of UN R79."""

    heading_gain: float = Field(0.5, ge=0.1, le=1.0)
    """Steering per angle between car and path."""
    offset_gain_per_s: float = Field(0.3, ge=0.05, le=2.0)
    """Steering angle per offset from the path, times the speed."""
    softening_mps: float = Field(1.0, ge=0.1, le=5.0)
    """Added to the speed, so that the wheel stays calm at walking pace."""
    max_lateral_mps2: float = Field(3.0, ge=1.0, le=6.0)
    """UN R79, 5.6.2.1.3: at most 3 m/s^2."""
    max_lateral_jerk_mps3: float = Field(5.0, ge=1.0, le=20.0)
    """UN R79, 5.6.2.1.3: at most 5 m/s^3."""


class EmergencyBraking(Document):
    """Automatic emergency braking for who is ahead in one's way (UN R152, car to car, 5.2.1)."""

    brakes_ttc_s: float = Field(1.4, ge=0.5, le=3.0)
    """Time to collision at which it brakes with all it has."""
    warns_before_s: float = Field(0.8, ge=0.0, le=2.0)
    """UN R152, 5.2.1.1: the warning comes at the latest 0.8 s before the emergency braking. Nobody is there to heed
    it: what is left of it is that the car slows by `warning_braking_mps2`."""
    warning_braking_mps2: float = Field(1.0, ge=0.0, le=4.0)
    """Braking while it warns: a jolt and the brakes made ready."""
    braking_mps2: float = Field(9.0, ge=5.0, le=12.0)
    """UN R152, 5.2.1.2: at least 5 m/s^2. The car gives what it has."""
    build_up_mps3: float = Field(30.0, ge=5.0, le=200.0)
    """How fast the braking grows."""


class ReferenceReaction(Document):
    """What the reference drivers have in common: how a person comes to brake (UN R157, Annex 4, Appendix 3)."""

    reaction_s: float = Field(0.75, ge=0.0, le=3.0)
    """From perceiving the risk to braking (table 1)."""
    jerk_mps3: float = Field(12.65, ge=1.0, le=50.0)
    """How fast the braking grows: 0.774 g in 0.6 s (table 1)."""
    full_braking_g: float = Field(0.774, ge=0.1, le=1.2)
    """Full braking (table 1)."""


class CarefulAndCompetent(ReferenceReaction):
    """The careful and competent human driver of UN R157 (Annex 4, Appendix 3: performance model 1)."""

    wander_m: float = Field(0.375, ge=0.0, le=2.0)
    """A car whose centre is farther than this from its lane's centre may be leaving the lane."""
    perception_s: float = Field(0.4, ge=0.0, le=2.0)
    """Time it takes to see that it does."""
    ttc_s: float = Field(2.0, ge=0.1, le=10.0)
    """Time to collision up to which that is a danger."""
    coasting_mps2: float = Field(0.4, ge=0.0, le=2.0)
    """What the car slows by while the foot is on its way from one pedal to the other (public programme of the EU
    Joint Research Centre)."""
    wrapped_braking_g: float = Field(0.85, ge=0.1, le=1.2)
    """Full braking once the other car is wholly ahead of one's own: emergency braking helps (table 1, after R152)."""
    wrapped_m: float = Field(0.1, ge=0.0, le=1.0)
    """How far beside one's own its centre line may be for that."""
    lane_width_m: float = Field(3.2, ge=2.0, le=5.0)
    """A driver sees where others are, not in which lane: beside one's own lane are taken to be lanes of this width."""


class Rss(ReferenceReaction):
    """Responsibility-sensitive safety (Shalev-Shwartz et al. 2017), parameters as in Mattas et al. 2022."""

    acceleration_mps2: float = Field(3.0, ge=0.0, le=6.0)
    """What one may gain while reacting."""
    braking_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """What one brakes with at least afterwards."""
    other_braking_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """What who leads brakes with at most."""
    lateral_mps2: float = Field(1.0, ge=0.1, le=5.0)
    """Lateral acceleration of others, both towards one and away."""
    lateral_margin_m: float = Field(0.3, ge=0.0, le=2.0)
    """mu: a distance to the side that is always kept."""


class FuzzySafety(ReferenceReaction):
    """The fuzzy safety model (Mattas et al. 2020; performance model 2 of UN R157)."""

    comfortable_mps2: float = Field(4.0, ge=1.0, le=12.0)
    """Braking that a proactive driver is content with."""
    hardest_mps2: float = Field(6.0, ge=1.0, le=12.0)
    """Braking in danger."""
    other_braking_mps2: float = Field(7.0, ge=1.0, le=12.0)
    """What who leads brakes with at most."""
    margin_m: float = Field(2.0, ge=0.0, le=10.0)
    """Distance left when both stand, and as much again on top of the safe distance."""
    lateral_margin_s: float = Field(0.1, ge=0.0, le=2.0)
    """By so much the other's time to reach one's way must exceed one's own time to be past."""

    @model_validator(mode="after")
    def _graded(self) -> FuzzySafety:
        if self.hardest_mps2 <= self.comfortable_mps2:
            raise ValueError("hardest_mps2 must exceed comfortable_mps2: between them lies what is fuzzy")
        return self


_USUAL = (
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
"""What may be searched of a driver whose document does not say."""
REACTIONS = ("emergency_braking", "careful_and_competent", "rss", "fuzzy")


class Rules(Adjustable):
    """A driver by rules. At most one of its tables says how it reacts to danger; without, it only cruises.

    Its parameters are called `<table>.<key>` in `tunable`. Without `tunable`, those of driver assistance that are set
    by taste may be searched, and nothing of a reference driver: tuned, it would be no reference.
    """

    parameter_table: ClassVar[str] = ""  # they are in several

    kind: Literal["rules"]
    """Which kind of driver this is: what the other keys are goes by it."""
    name: Name
    """What these rules are called in reports."""
    description: str = Field(min_length=10, max_length=2000)
    """Who drives so, in a sentence."""
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
            raise ValueError(f"give one of the tables {', '.join(given)}: a driver reacts to danger in one way")
        return self

    @property
    def searched(self) -> tuple[Tunable, ...]:
        """What may be searched for a better driver."""
        if self.tunable is not None:
            return self.declared
        if any(getattr(self, name) is not None for name in REACTIONS[1:]):
            return ()
        now = self.numbers
        return tuple(Tunable(key, min(low, now[key]), max(high, now[key])) for key, low, high in _USUAL if key in now)

    @property
    def numbers(self) -> dict[str, float]:
        """Every parameter, by its table and key."""
        tables = {name: getattr(self, name) for name in ("cruise", "lane_keeping", *REACTIONS)}
        return {
            f"{name}.{key}": value
            for name, table in tables.items()
            if table is not None
            for key, value in table.model_dump().items()
        }

    def _put(self, document: dict[str, Any], key: str, value: float) -> None:
        table, name = key.split(".")
        document[table][name] = value
