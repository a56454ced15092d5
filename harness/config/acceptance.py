"""The bounds by which a campaign passes or fails."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from harness.config.toml_reading import Document

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Acceptance(Document):
    """Bounds that the ego must keep for the campaign to pass. Each is judged for every persona and training seed, by
    the unfavourable end of its 95 % interval, so that few games don't pass where many would fail. A bound that is left
    out is not judged; one that can't be measured is not kept. `harness campaign` and `harness report` end with exit
    code 3 if a bound is not kept."""

    ego: Literal["last", "robust", "naive"] = "last"
    """The ego that is judged. `last`: that of the last round against each persona; the naive ego, if no round changes
    it. `robust`: the ego retrained against several personas. `naive`: the ego before round 2."""
    failure_rate: Share | None = None
    """Largest failure rate against a persona, in any arm of this ego against this persona."""
    failure_rate_alone: Share | None = None
    """Largest failure rate without the non-ego: what the ego could do before, it must not forget."""
    preventable_failure_rate: Share | None = None
    """Largest rate of failures against a persona that a reference driver prevents when it drives the game from its
    start. Measured with assessment.reference_drivers."""
    near_miss_rate: Share | None = None
    """Largest share of games with a near miss against a persona: no contact, but closer than the bounds of the column
    `near_miss` of episodes.csv."""
    speed_loss_mps: Annotated[float, Field(ge=0.0, le=100.0)] | None = None
    """Largest loss of average speed against a persona, compared with the naive ego in the same games."""
    gap_share: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    """Largest best-response gap of the ego, as a share of its payoff. Measured with [best_response]."""

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that are given, by their keys."""
        values = self.model_dump(exclude={"ego"}, exclude_none=True)
        return {name: float(value) for name, value in values.items()}

    @property
    def needs_gaps(self) -> bool:
        """Whether a bound needs the table [best_response]."""
        return self.gap_share is not None

    @model_validator(mode="after")
    def _bounds_something(self) -> Acceptance:
        if not self.bounds:
            raise ValueError("no bound is given: add one, such as failure_rate = 0.1, or leave out the table")
        return self
