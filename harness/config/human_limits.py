"""Human limits of a persona, beside its payoff: attention, perception, reaction time and use of the car."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from harness.config.toml_reading import Document, ordered

_DelayS = Annotated[float, Field(ge=0.0, le=5.0)]


class AttentionLapses(Document):
    """When attention lapses, how long a lapse lasts, and how the car drifts in it."""

    mean_attentive_s: float = Field(gt=0.1, le=3600.0)
    """Mean time between lapses (exponential distribution)."""
    lapse_s: Annotated[tuple[Annotated[float, Field(gt=0.0)], float], AfterValidator(ordered)]
    """Range of the length of a lapse (uniform distribution). In a lapse the policy's actions are omitted: pedals and
    wheel are released."""
    crown_steering_rad: float = Field(0.0, ge=0.0, le=0.1)
    """Steering angle, to the right, that the crown of the road gives to a released wheel."""
    bump_steering_sd_rad: float = Field(0.0, ge=0.0, le=0.1)
    """Standard deviation, from lapse to lapse, of the steering angle that bumps and the car's own pull add to it."""


class ReactionTime(Document):
    """How late decisions reach pedals and wheel, in the training of the person as well."""

    delay_s: Annotated[tuple[_DelayS, _DelayS], AfterValidator(ordered)]
    """Range of the delay (uniform distribution, drawn for each drive), within 0 to 5 s. Until the first decision
    arrives, the car coasts straight on."""


class Perception(Document):
    """What a person fails to see. No blind-spot check, and looking but failing to see, are habits of driving, not of
    learning: they do not apply in the training of the person, because a car that is not seen and does no harm teaches
    nothing. How far and how exactly a person sees is a limit of the body, and applies in training as well."""

    no_blind_spot_check_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person does not look into the mirrors and over the shoulder."""
    unseen_behind_m: float = Field(0.0, ge=-20.0, le=100.0)
    """In such a drive, a car is not seen if its centre is less than this far ahead of the centre of the person's own
    car."""
    looked_but_failed_to_see_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person looks but fails to see: other cars are noticed only when they are
    near."""
    noticed_within_m: float | None = Field(None, gt=0.0, le=100.0)
    """In such a drive, other cars are seen only within this distance, from centre to centre."""
    range_m: float | None = Field(None, gt=0.0, le=100.0)
    """Other cars farther away than this, from centre to centre, are never seen."""
    opening_deg: float | None = Field(None, gt=0.0, le=360.0)
    """Angle of view, ahead of the car and half of it to each side: other cars whose centre is outside it are never
    seen. Left out: all around, as with mirrors."""
    distance_error: float = Field(0.0, ge=0.0, le=1.0)
    """Error in the estimated distance of other cars: standard deviation of the logarithm of the factor, so 0.1 is about
    10 %."""
    closing_error_per_s: float = Field(0.0, ge=0.0, le=1.0)
    """Error in the estimated closing speed of other cars: standard deviation, per distance. 0.01 is 0.3 m/s at 30 m."""

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> Perception:
        if bool(self.looked_but_failed_to_see_share) != (self.noticed_within_m is not None):
            raise ValueError("looked_but_failed_to_see_share and noticed_within_m have no effect alone: give both")
        return self


class CarUse(Document):
    """Shares of what the car can do that the person uses with pedals and wheel at their limit, in the training of the
    person as well."""

    throttle_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the car's acceleration."""
    braking_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the car's braking."""
    steering_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the useful steering angle at the current speed."""
