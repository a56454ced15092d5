"""A persona: what a kind of person wants of a drive, and how they attend to it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    field_validator,
    model_serializer,
    model_validator,
)

from harness.config.human_limits import AttentionLapses, CarUse, Perception, ReactionTime
from harness.config.scene import Name
from harness.config.toml_reading import NUMBER, TABLE, Document, Mistakes, nearest
from harness.game.attention import HumanFactors
from harness.game.fuzzy import FuzzyFunction, FuzzySet
from harness.game.human_limits import ALL_NOTICED, EXACT_SIGHT, FULL_SHARES, NO_DELAY
from harness.game.payoff import FUZZY_QUANTITIES, GROUPS, NEARNESS, TERMS, Payoff, Weighted

Weight = Annotated[float, Field(ge=0.0, le=1000.0)]
Input = Annotated[float, Field(ge=-1e6, le=1e6)]
Membership = Annotated[float, Field(ge=0.0, le=1.0)]


class Source(Document):
    """What is known of such people: the statistic the persona rests on, and where it is from."""

    statistic: str = Field(min_length=10, max_length=2000)
    """What was counted or measured, with its figure."""
    citation: str = Field(min_length=5, max_length=2000)
    """Who published it, where and when."""


class Parametrised(Document):
    """A term that takes a limit: `{ weight = 1.0, within_m = 0.5 }`."""

    weight: Weight
    """What the term counts."""
    within_m: float | None = Field(None, gt=0.0, le=100.0)
    """The distance from which on the term is nothing."""
    within_s: float | None = Field(None, gt=0.0, le=60.0)
    """The time from which on the term is nothing."""


WeightOrTable = Annotated[
    Annotated[Weight, Tag(NUMBER)] | Annotated[Parametrised, Tag(TABLE)],
    Discriminator(lambda given: TABLE if isinstance(given, dict | Parametrised) else NUMBER),
]


class Group(Document):
    """One of equation 1's three groups of terms. A term that is left out weighs nothing."""

    weight: Weight = 1.0
    """Its coefficient alpha in equation 1."""
    terms: dict[str, WeightOrTable] = Field(default_factory=dict)
    """Each term's weight, or its weight and limit."""


class MembershipFunction(Document):
    """A fuzzy set: linear between points of [input, membership in 0..1], constant outside them."""

    name: Name
    """What the set is called."""
    points: list[tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=0.0, le=1.0)]]] = Field(
        min_length=1, max_length=20
    )
    """Points of [input in the quantity's unit, membership], the inputs rising."""
    value: float = Field(ge=-1000.0, le=1000.0)
    """What being wholly in this set is worth, per second."""

    @field_validator("points")
    @classmethod
    def _rising(cls, points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        inputs = [point[0] for point in points]
        if inputs != sorted(set(inputs)):
            raise ValueError("the points' inputs must rise")
        return points

    @property
    def fuzzy_set(self) -> FuzzySet:
        """The set as the game knows it."""
        inputs, memberships = zip(*self.points, strict=True)
        return FuzzySet(name=self.name, inputs=inputs, memberships=memberships, value=self.value)


class FuzzyTerm(Document):
    """A human term declared by membership functions over one quantity of the game."""

    name: Name
    """What the term is called, in tables too."""
    weight: Weight = 1.0
    """What the function's value is multiplied by."""
    quantity: str
    """The quantity of the game that it is a function of."""
    sets: list[MembershipFunction] = Field(min_length=1, max_length=20)
    """The fuzzy sets. Between them the value is the average of theirs, weighted by membership; outside all, 0."""

    @field_validator("quantity")
    @classmethod
    def _known(cls, quantity: str) -> str:
        if quantity not in FUZZY_QUANTITIES:
            raise ValueError(f"unknown quantity {quantity!r}: {nearest(quantity, FUZZY_QUANTITIES)}")
        return quantity

    @field_validator("name")
    @classmethod
    def _free(cls, name: str) -> str:
        if name in TERMS:
            raise ValueError(f"{name!r} is a built-in term: give the fuzzy term another name")
        return name

    @model_validator(mode="after")
    def _contact_is_worst(self) -> FuzzyTerm:
        if self.quantity in NEARNESS:
            inputs = {0.0, *(max(point[0], 0.0) for each in self.sets for point in each.points)}
            some = np.array(sorted(inputs | {each + 1e-6 for each in inputs} | {max(inputs) + 1.0}))
            worth = self.function(some)
            if worth[0] > worth.min() + 1e-9:
                raise ValueError(
                    f"nobody may be paid for a crash: at contact (0) it is worth {worth[0]:g}, "
                    f"more than the {worth.min():g} at {some[worth.argmin()]:g}"
                )
        return self

    @property
    def function(self) -> FuzzyFunction:
        """The function of the quantity."""
        return FuzzyFunction(self.quantity, tuple(each.fuzzy_set for each in self.sets))


class Human(Group):
    """The human group: besides named terms, any number of fuzzy ones."""

    fuzzy: list[FuzzyTerm] = Field(default_factory=list, max_length=50)
    """Terms declared by membership functions."""


def _fits(parameter: str, given: float | Parametrised) -> bool:
    """Whether a term that takes this limit (or none) was given as it has to be."""
    if isinstance(given, Parametrised):
        return {name for name in ("within_m", "within_s") if getattr(given, name) is not None} == {parameter}
    return not parameter


class Persona(Document):
    """A kind of driver, as equation 1 and human limits."""

    name: Name
    """What such a person is called, in stages, arms and tables."""
    description: str = Field(min_length=10, max_length=2000)
    """Who this is, in a sentence."""
    sources: list[Source] = Field(min_length=1, max_length=50)
    """What is known of such people: no persona without a statistic."""
    safety: Group = Group()
    operational: Group = Group()
    human: Human = Human()
    attention: AttentionLapses | None = None
    perception: Perception | None = None
    reaction: ReactionTime | None = None
    actuators: CarUse | None = None
    decisions: Literal["mode", "sampled"] = "mode"
    """Whether it always takes its policy's most likely action, or varies as the policy does."""

    @model_validator(mode="after")
    def _terms_fit(self) -> Persona:
        wrong = []
        for group in GROUPS:
            known = [name for name, term in TERMS.items() if term.group == group]
            for name, given in getattr(self, group).terms.items():
                key = f"{group}.terms.{name}"
                if name in TERMS and name not in known:
                    right = TERMS[name].group
                    wrong.append((key, f"belongs to the {right} terms", f"move it to [{right}.terms]"))
                elif name not in known:
                    wrong.append((key, f"unknown {group} term", nearest(name, known)))
                elif not _fits(TERMS[name].parameter, given):
                    limit = TERMS[name].parameter
                    remedy = f"{{ weight = ..., {limit} = ... }}" if limit else "a plain weight"
                    wrong.append((key, "its weight is not given as it has to be", f"give {remedy}"))
        names = [each.name for each in self.human.fuzzy]
        for k, name in enumerate(names):
            if name in names[:k]:
                wrong.append((f"human.fuzzy[{k}].name", f"{name!r} stands twice", "give each a name of its own"))
        if wrong:
            raise Mistakes(wrong)
        if not any(getattr(self, group).terms for group in GROUPS) and not self.human.fuzzy:
            raise ValueError("the payoff has no terms: nothing could be learned from it")
        return self

    @model_serializer(mode="wrap")
    def _without_limits_that_nobody_has(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A person without the limits of later versions is written as before them: stages keep their keys."""
        written: dict[str, Any] = dump(self)
        for table in ("reaction", "actuators"):
            if written.get(table, 0) is None:
                del written[table]
        return written

    @property
    def payoff(self) -> Payoff:
        """Equation 1 of this persona."""
        terms = []
        for group in (self.safety, self.operational, self.human):
            for name, given in group.terms.items():
                if isinstance(given, Parametrised):
                    parameter = given.within_m or given.within_s
                    terms.append(Weighted(name=name, weight=given.weight, parameter=parameter))
                else:
                    terms.append(Weighted(name=name, weight=given))
        fuzzy = {each.name: (each.weight, each.function) for each in self.human.fuzzy}
        alpha = {
            "safety": self.safety.weight,
            "operational": self.operational.weight,
            "human": self.human.weight,
        }
        return Payoff(alpha=alpha, terms=tuple(terms), fuzzy=fuzzy)

    @property
    def human_factors(self) -> HumanFactors:
        """How this person attends to the road."""
        perception = self.perception
        return HumanFactors(
            attention=self.attention.attention if self.attention else None,
            no_blind_spot_check=perception.no_blind_spot_check if perception else HumanFactors.no_blind_spot_check,
            looked_but_failed_to_see=perception.looked_but_failed_to_see if perception else ALL_NOTICED,
            reaction=self.reaction.reaction if self.reaction else NO_DELAY,
            sight=perception.sight if perception else EXACT_SIGHT,
            actuator_shares=self.actuators.uses if self.actuators else FULL_SHARES,
        )
