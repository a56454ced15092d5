"""The traits of a person: the parts of its document that can be exchanged with another person's when it drives.

The payoff is the policy that was learned with it. The other traits are human limits and the way to decide, which a
driver has when it plays, whatever it learned under. A key of `Persona` is in one trait, or in `NO_TRAIT`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from harness.config.persona import Persona

PAYOFF, ATTENTION = "payoff", "attention"
NO_TRAIT = ("name", "description", "sources", "unlike_people")
"""The keys that say who the person is, and do not drive: no policy learns by them."""


@dataclass(frozen=True, kw_only=True)
class Trait:
    """A trait: the keys of `Persona` that make it, and what it is in a sentence, after "the" and before "of"."""

    keys: tuple[str, ...]
    words: str


TRAITS: Mapping[str, Trait] = {
    PAYOFF: Trait(keys=("safety", "operational", "human"), words="payoff and policy"),
    "decisions": Trait(keys=("decisions",), words="way to decide"),
    ATTENTION: Trait(keys=("attention",), words="attention"),
    "reaction": Trait(keys=("reaction",), words="reaction time"),
    "shoulder_glance": Trait(keys=("perception.no_shoulder_glance_share",), words="shoulder glances"),
    "noticing": Trait(
        keys=("perception.looked_but_failed_to_see_share", "perception.noticed_within_m"),
        words="noticing of others",
    ),
    "sight": Trait(keys=("perception.range_m", "perception.field_of_view_deg"), words="range and field of view"),
    "estimation": Trait(
        keys=("perception.distance_error", "perception.closing_error_per_s"),
        words="estimates of distance and speed",
    ),
    "actuators": Trait(keys=("actuators",), words="actuators"),
}
"""By name."""


@dataclass(frozen=True, kw_only=True)
class PersonTraits:
    """What a plan knows of the documents of a campaign's personas."""

    lapsing: tuple[str, ...] = ()
    """The personas whose attention lapses."""
    baseline: str = ""
    """The person with which `[attribution]` compares them; empty: none."""
    differing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By persona: the traits in which it differs from the baseline; without the personas that differ in none."""


UNREAD = PersonTraits()
"""No document is read: the plan has no arms that depend on traits."""


def traits_of(personas: Iterable[Persona], baseline: Persona | None) -> PersonTraits:
    """What a plan knows of personas and of the campaign's baseline, if it has one."""
    personas = list(personas)
    lapsing = tuple(each.name for each in personas if each.attention is not None)
    if baseline is None:
        return PersonTraits(lapsing=lapsing)
    found = {each.name: differing_traits(each, baseline) for each in personas}
    return PersonTraits(
        lapsing=lapsing,
        baseline=baseline.name,
        differing={name: traits for name, traits in found.items() if traits},
    )


def differing_traits(persona: Persona, other: Persona) -> tuple[str, ...]:
    """The traits in which two persons differ, in the order of `TRAITS`."""
    return tuple(
        name for name, trait in TRAITS.items() if any(_value(persona, key) != _value(other, key) for key in trait.keys)
    )


def with_trait_of(persona: Persona, trait: str, other: Persona | None) -> Persona:
    """A persona with one trait of another one; None: of nobody, whose keys have the defaults of the document."""
    giver = Persona.model_construct(name="", description="", sources=[]) if other is None else other
    for key in TRAITS[trait].keys:
        table, _, name = key.partition(".")
        value = _value(giver, key)
        if name:
            value = getattr(persona, table).model_copy(update={name: value})
        persona = persona.model_copy(update={table: value})
    return persona


def _value(persona: Persona, key: str) -> object:
    table, _, name = key.partition(".")
    return getattr(getattr(persona, table), name) if name else getattr(persona, table)
