"""How a person attends to the road, and what its body can't do: the tables of a persona beside its payoff."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from harness.config.scene import Interval
from harness.config.toml_reading import Document
from harness.game.attention import Attention, NoBlindSpotCheck
from harness.game.human_limits import (
    ALL_NOTICED,
    PERSISTENCE_S,
    ActuatorShares,
    LookedButFailedToSee,
    Reaction,
    Sight,
)

LONGEST_DELAY_S = 5.0
LATER = ("misses_share", "noticed_within_m", "range_m", "distance_error", "closing_error_per_s", "error_s")
"""Keys of perception that earlier versions did not know."""


class AttentionLapses(Document):
    """When attention lapses, for how long, and what the car does meanwhile."""

    mean_attentive_s: float = Field(gt=0.1, le=3600.0)
    """Mean time between lapses (exponential)."""
    lapse_s: Interval
    """Range of a lapse's length (uniform). In it the policy's actions are omitted: pedals and wheel are let go."""
    crown_rad: float = Field(0.0, ge=0.0, le=0.1)
    """Steering angle, to the right, that the road's crown makes of a wheel let go."""
    bumps_rad: float = Field(0.0, ge=0.0, le=0.1)
    """Standard deviation, from lapse to lapse, of the steering angle that bumps and the car's own pull add to it."""

    @field_validator("lapse_s")
    @classmethod
    def _positive(cls, lapse_s: tuple[float, float]) -> tuple[float, float]:
        if lapse_s[0] <= 0.0:
            raise ValueError("a lapse must last longer than 0 s")
        return lapse_s

    @property
    def attention(self) -> Attention:
        """When attention lapses, as the game knows it."""
        return Attention(
            mean_attentive_s=self.mean_attentive_s,
            lapse_s=self.lapse_s,
            crown_rad=self.crown_rad,
            bumps_rad=self.bumps_rad,
        )


class ReactionTime(Document):
    """How late decisions reach pedals and wheel: while the person itself is trained, too."""

    delay_s: Interval
    """Range of the delay (uniform, drawn for each drive). Until the first decision arrives, the car coasts straight
    on. 0 to 5 s."""

    @field_validator("delay_s")
    @classmethod
    def _possible(cls, delay_s: tuple[float, float]) -> tuple[float, float]:
        if not 0.0 <= delay_s[0] <= delay_s[1] <= LONGEST_DELAY_S:
            raise ValueError(f"decisions arrive 0 to {LONGEST_DELAY_S:g} s later")
        return delay_s

    @property
    def reaction(self) -> Reaction:
        """How late decisions arrive, as the game knows it."""
        return Reaction(self.delay_s)


class Perception(Document):
    """What a person fails to see. NoBlindSpotCheck and missing others are habits of driving, not of learning: while the
    person itself is trained, its eyes are open, for nobody has learned from what was overlooked and went well. How
    far and how exactly it sees is the body's doing, and there from the first lesson on."""

    overlooks_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person does not look into the mirrors and over the shoulder."""
    overlooked_up_to_m: float = Field(0.0, ge=-20.0, le=100.0)
    """In such a drive, others whose centre is not at least this far ahead of the person's own are not seen."""
    misses_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person looks and fails to see: others are noticed only when they are near."""
    noticed_within_m: float | None = Field(None, gt=0.0, le=100.0)
    """In such a drive, others are seen only within this distance, from centre to centre."""
    range_m: float | None = Field(None, gt=0.0, le=100.0)
    """Others farther away than this, from centre to centre, are never seen."""
    distance_error: float = Field(0.0, ge=0.0, le=1.0)
    """Standard deviation of how far off the distance of others is judged: of the logarithm of its factor, so 0.1 is
    about a tenth."""
    closing_error_per_s: float = Field(0.0, ge=0.0, le=1.0)
    """Standard deviation of how far off others' closing speed is judged, per distance: 0.01 is 0.3 m/s at 30 m."""
    error_s: float = Field(PERSISTENCE_S, gt=0.0, le=3600.0)
    """How long such an error lasts (correlation time)."""

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> Perception:
        if self.misses_share and self.noticed_within_m is None:
            raise ValueError("misses_share says nothing without noticed_within_m: give the distance")
        if self.noticed_within_m is not None and not self.misses_share:
            raise ValueError("noticed_within_m says nothing without misses_share: give the share of the drives")
        if "error_s" in self.model_fields_set and not self.distance_error and not self.closing_error_per_s:
            raise ValueError("error_s says nothing without distance_error or closing_error_per_s: give one of them")
        return self

    @model_serializer(mode="wrap")
    def _without_limits_that_nobody_has(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A person without the limits of later versions is written as before them: stages keep their keys."""
        usual = {name: Perception.model_fields[name].default for name in LATER}
        return {key: each for key, each in dump(self).items() if key not in LATER or each != usual[key]}

    @property
    def no_blind_spot_check(self) -> NoBlindSpotCheck:
        """Whom the person overlooks."""
        return NoBlindSpotCheck(share=self.overlooks_share, ahead_m=self.overlooked_up_to_m)

    @property
    def looked_but_failed_to_see(self) -> LookedButFailedToSee:
        """Whom the person looks at and fails to see."""
        if self.noticed_within_m is None:
            return ALL_NOTICED
        return LookedButFailedToSee(share=self.misses_share, within_m=self.noticed_within_m)

    @property
    def sight(self) -> Sight:
        """How far and how exactly the person sees."""
        return Sight(
            range_m=np.inf if self.range_m is None else self.range_m,
            distance_error=self.distance_error,
            closing_error_per_s=self.closing_error_per_s,
            error_s=self.error_s,
        )


class CarUse(Document):
    """Shares of what the car can do that this person uses, with pedals and wheel as far as they go: while the person
    itself is trained, too."""

    throttle_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the car's acceleration."""
    braking_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the car's braking."""
    steering_share: float = Field(1.0, gt=0.0, le=1.0)
    """Share of the steering angle that is of use at the speed."""

    @property
    def uses(self) -> ActuatorShares:
        """What the person uses of the car, as the game knows it."""
        return ActuatorShares(throttle=self.throttle_share, braking=self.braking_share, steering=self.steering_share)
