"""Perception errors of an ego: what its object list lacks, has too much, and has inexactly."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from harness.config.persona import Source
from harness.config.scene import Name
from harness.config.toml_reading import Document, Mistakes, ordered
from harness.game import perception_errors as game

_PerMin = Annotated[float, Field(ge=0.0, le=600.0)]
_DurationS = Annotated[float, Field(ge=0.05, le=600.0)]
_Place = Annotated[float, Field(ge=-120.0, le=120.0)]
_Speed = Annotated[float, Field(ge=-60.0, le=60.0)]
_Places = Annotated[tuple[_Place, _Place], AfterValidator(ordered)]
_Speeds = Annotated[tuple[_Speed, _Speed], AfterValidator(ordered)]
MOST_EXPECTED = 2.0
"""Ghosts at a time, on average."""


class Loss(Document):
    """How often and for how long an object at a distance is lost."""

    distance_m: float = Field(ge=0.0, le=200.0)
    """The distance of the object, from centre to centre. Between two tables values are linear, beyond them constant."""
    losses_per_min: _PerMin
    """How often an object that is in the list is lost, per minute (exponential distribution)."""
    mean_duration_s: _DurationS
    """How long it is lost, on average (exponential distribution)."""


class Ghosts(Document):
    """Objects that are not there. Where and how fast is drawn uniformly for each. The ego alone sees them."""

    per_min: _PerMin
    """How many appear per minute (exponential distribution)."""
    mean_lifetime_s: _DurationS
    """How long one is seen, on average (exponential distribution)."""
    ahead_m: _Places
    """Range of the place where one appears, from the ego's centre along its heading."""
    left_m: _Places
    """The same across, to the left."""
    speed_mps: _Speeds = (0.0, 0.0)
    """Range of its speed, which it keeps, in the heading of the ego where it appears."""
    length_m: float = Field(4.5, gt=0.0, le=30.0)
    """Length of its body."""
    width_m: float = Field(1.8, gt=0.0, le=5.0)
    """Width of its body."""

    @model_validator(mode="after")
    def _few_at_once(self) -> Ghosts:
        expected = self.per_min / 60.0 * self.mean_lifetime_s
        if expected > MOST_EXPECTED:
            message = f"{expected:.3g} ghosts are there at a time, on average"
            raise Mistakes([("per_min", message, f"give at most {60.0 * MOST_EXPECTED / self.mean_lifetime_s:.4g}")])
        return self


class PositionNoise(Document):
    """Error in the position of each object, in x and in y, correlated in time."""

    sd_m: float = Field(0.0, ge=0.0, le=10.0)
    """Standard deviation at the ego."""
    sd_share: float = Field(0.0, ge=0.0, le=0.5)
    """What is added to it, as a share of the distance. 0.01 is 0.5 m at 50 m."""
    persistence_s: float = Field(1.0, ge=0.01, le=600.0)
    """Correlation time."""


class SpeedNoise(Document):
    """Error in the speed of each object, correlated in time."""

    sd_mps: float = Field(0.0, ge=0.0, le=20.0)
    """Standard deviation at the ego."""
    sd_per_s: float = Field(0.0, ge=0.0, le=1.0)
    """What is added to it, per distance. 0.01 is 0.5 m/s at 50 m."""
    persistence_s: float = Field(1.0, ge=0.01, le=600.0)
    """Correlation time."""


class EgoPerception(Document):
    """Perception errors of the ego: of its list of road users and obstacles. Of itself, the road, signs and signals it
    knows what is there."""

    name: Name
    """The name of the perception in reports."""
    description: str = Field(min_length=10, max_length=2000)
    """What is modelled, and which values are assumptions."""
    sources: list[Source] = Field([], max_length=50)
    """The evidence for values that are not assumptions."""
    range_m: float = Field(120.0, gt=0.0, le=120.0)
    """Objects farther away than this, from centre to centre, are not in the list. An observation has none beyond 120 m.
    """
    field_of_view_deg: float = Field(360.0, gt=0.0, le=360.0)
    """Angle, ahead of the ego and half of it to each side, within which objects are in the list."""
    latency_s: float = Field(0.0, ge=0.0, le=3.0)
    """Age of the list that the ego knows. Objects are where they were then: nothing is extrapolated."""
    loss: list[Loss] = Field([], max_length=50)
    """Objects that are lost for a while: `[[loss]]` for each distance, the nearest first. Left out: none is lost."""
    position_noise: PositionNoise = PositionNoise()
    speed_noise: SpeedNoise = SpeedNoise()
    ghosts: Ghosts | None = None

    @model_validator(mode="after")
    def _distances_increase(self) -> EgoPerception:
        mistakes = [
            (f"loss[{k}].distance_m", f"{after.distance_m:g} m is not farther than the table before", "sort the tables")
            for k, (before, after) in enumerate(zip(self.loss, self.loss[1:], strict=False), 1)
            if after.distance_m <= before.distance_m
        ]
        if mistakes:
            raise Mistakes(mistakes)
        return self

    @property
    def errors(self) -> game.PerceptionErrors:
        """The errors as the game uses them."""
        position, speed, ghosts = self.position_noise, self.speed_noise, self.ghosts
        return game.PerceptionErrors(
            range_m=self.range_m,
            field_of_view_rad=float(np.deg2rad(self.field_of_view_deg)),
            latency_s=self.latency_s,
            losses=tuple((each.distance_m, each.losses_per_min, each.mean_duration_s) for each in self.loss),
            position=game.Noise(sd=position.sd_m, sd_per_m=position.sd_share, persistence_s=position.persistence_s),
            speed=game.Noise(sd=speed.sd_mps, sd_per_m=speed.sd_per_s, persistence_s=speed.persistence_s),
            ghosts=None if ghosts is None else game.GhostRates(**ghosts.model_dump()),
        )
