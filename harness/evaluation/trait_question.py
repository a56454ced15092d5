"""The question of `[attribution]` on four arms with their possible answers: it loads no tables, as plans do not."""

from __future__ import annotations

from dataclasses import dataclass

from harness.evaluation.competence import AloneBound

ALL_TRAITS = "all"
"""The row of all traits together: the person against the baseline."""


@dataclass(frozen=True, kw_only=True)
class TraitQuestion:
    """How many failures one trait of a persona causes, for one training seed: four arms of the same episodes."""

    persona: str
    seed: int
    trait: str
    """Its name in `config.traits.TRAITS`, or `ALL_TRAITS`."""
    arm: str
    """The ego against the persona."""
    without_arm: str
    """Against the persona with the baseline's value of the trait."""
    baseline_arm: str
    """Against the baseline."""
    alone_arm: str
    """Against the baseline with the persona's value of the trait; empty of `ALL_TRAITS`: that is the persona."""
    bounds: tuple[AloneBound, ...] = ()
    """What ego, persona and baseline have to achieve alone; otherwise there is no test."""

    @property
    def arms(self) -> tuple[str, ...]:
        """The arms that it compares."""
        return tuple(filter(None, (self.arm, self.without_arm, self.baseline_arm, self.alone_arm)))
