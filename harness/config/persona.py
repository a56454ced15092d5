"""A persona: the payoff and the human limits of a kind of driver."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, field_validator, model_validator

from harness.config.scene import Name
from harness.config.toml_reading import NUMBER, TABLE, Document, Mistakes, nearest, one_of, ordered
from harness.game.human_factors import ActuatorShares, HumanFactors, Sight
from harness.game.lapses import Attention, Controls
from harness.game.payoff import FuzzyFunction, FuzzySet, Payoff, Weighted
from harness.game.payoff_terms import FUZZY_QUANTITIES, GROUPS, NEARNESS, TERMS

Weight = Annotated[float, Field(ge=0.0, le=1000.0)]
Point = tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=0.0, le=1.0)]]


class Source(Document):
    """The evidence for a persona: a statistic and its source."""

    statistic: str = Field(min_length=10, max_length=2000)
    """What was counted or measured, with the figure."""
    citation: str = Field(min_length=5, max_length=2000)
    """Author, publication and year."""


COMPARED_WITH_PEOPLE = (
    *("lane_change_s", "free_over_limit_mps", "following_gap_s", "accepted_gap_s", "max_deceleration_mps2"),
    *("max_lateral_acceleration_mps2", "max_jerk_mps3", "lateral_wander_m", "latest_red_s_at_most_2"),
    *("moving_speed_mps", "crashes_per_million_km", "crash_odds_ratio"),
)
"""The figures of `realism.csv` that have a published range."""


class UnlikePeople(Document):
    """A figure in which the person is known not to be like people: it withholds no answer about the person."""

    figure: Annotated[str, one_of(COMPARED_WITH_PEOPLE, "unknown figure")]
    """The figure, as in the column `figure` of `realism.csv`."""
    reason: str = Field(min_length=10, max_length=1000)
    """Why the person is asked about all the same; a sentence."""


class Parametrised(Document):
    """A term with a limit: `{ weight = 1.0, within_m = 0.5 }`."""

    weight: Weight
    """The term's weight."""
    within_m: float | None = Field(None, gt=0.0, le=100.0)
    """The term is 0 from this distance on."""
    within_s: float | None = Field(None, gt=0.0, le=60.0)
    """The term is 0 from this time on."""
    after_s: float | None = Field(None, ge=0.0, le=600.0)
    """The term counts from this time on."""
    from_mps: float | None = Field(None, ge=0.0, le=100.0)
    """The term counts from this speed on."""

    @property
    def limits(self) -> dict[str, float]:
        return self.model_dump(exclude={"weight"}, exclude_none=True)


WeightOrTable = Annotated[
    Annotated[Weight, Tag(NUMBER)] | Annotated[Parametrised, Tag(TABLE)],
    Discriminator(lambda value: TABLE if isinstance(value, dict | Parametrised) else NUMBER),
]


class Group(Document):
    """One of the three groups of terms in equation 1. A term that is left out has the weight 0."""

    weight: Weight = 1.0
    """Coefficient alpha of the group in equation 1."""
    terms: dict[str, WeightOrTable] = Field(default_factory=dict)
    """Each term's weight, or its weight and limit."""


class MembershipFunction(Document):
    """A fuzzy set: membership is linear between the points [input, membership in 0..1], and constant outside them."""

    name: Name
    """The name of the set."""
    points: list[Point] = Field(min_length=1, max_length=20)
    """Points [input in the unit of the quantity, membership], with increasing inputs."""
    value: float = Field(ge=-1000.0, le=1000.0)
    """Payoff per second at full membership."""

    @field_validator("points")
    @classmethod
    def _inputs_increase(cls, points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        inputs = [point[0] for point in points]
        if inputs != sorted(set(inputs)):
            raise ValueError("the inputs of the points must increase")
        return points


class FuzzyTerm(Document):
    """A human term defined by membership functions of one quantity of the game."""

    name: Name
    """The name of the term, also in tables."""
    weight: Weight = 1.0
    """Factor of the function's value."""
    quantity: Annotated[str, one_of(FUZZY_QUANTITIES, "unknown quantity")]
    """The quantity of the game that the term is a function of."""
    sets: list[MembershipFunction] = Field(min_length=1, max_length=20)
    """The fuzzy sets. The value of the term is the mean of their values, weighted by membership; 0 outside all sets."""

    @field_validator("name")
    @classmethod
    def _name_is_not_built_in(cls, name: str) -> str:
        if name in TERMS:
            raise ValueError(f"{name!r} is a built-in term: give the fuzzy term another name")
        return name

    @model_validator(mode="after")
    def _contact_is_worst(self) -> FuzzyTerm:
        if self.quantity in NEARNESS:
            inputs = {0.0, *(max(point[0], 0.0) for each in self.sets for point in each.points)}
            samples = np.array(sorted(inputs | {each + 1e-6 for each in inputs} | {max(inputs) + 1.0}))
            values = self.function(samples)
            if values[0] > values.min() + 1e-9:
                raise ValueError(
                    f"a crash must not be rewarded: the value at contact (0) is {values[0]:g}, "
                    f"more than the {values.min():g} at {samples[values.argmin()]:g}"
                )
        return self

    @property
    def function(self) -> FuzzyFunction:
        sets = []
        for each in self.sets:
            inputs, memberships = zip(*each.points, strict=True)
            sets.append(FuzzySet(name=each.name, inputs=inputs, memberships=memberships, value=each.value))
        return FuzzyFunction(quantity=self.quantity, sets=tuple(sets))


class Human(Group):
    """The human group: named terms, and any number of fuzzy terms."""

    fuzzy: list[FuzzyTerm] = Field(default_factory=list, max_length=50)
    """Terms defined by membership functions."""


_DelayS = Annotated[float, Field(ge=0.0, le=5.0)]


class AttentionLapses(Document):
    """When attention lapses, how long a lapse lasts, and what the car does in it."""

    mean_attentive_s: float = Field(gt=0.1, le=3600.0)
    """Mean time between lapses (exponential distribution)."""
    lapse_s: Annotated[tuple[Annotated[float, Field(gt=0.0)], float], AfterValidator(ordered)]
    """Range of the length of a lapse. In a lapse the policy's actions are omitted."""
    lapse_distribution: Literal["uniform", "lognormal"] = "uniform"
    """`uniform`: within the range. `lognormal`: the range holds the middle 90 % of the lapses."""
    controls: Controls = "released"
    """What happens to pedals and wheel in a lapse. `released`: the car coasts with a straight wheel. `held`: the pedals
    stay as they are, and the wheel follows the road, as in a glance at a telephone, which ends where the time to
    collision with the vehicle ahead is 4 s or less."""
    bump_steering_sd_rad: float = Field(0.0, ge=0.0, le=0.1)
    """Standard deviation, from lapse to lapse, of the steering angle that bumps and the car's own pull give the
    wheel."""


class ReactionTime(Document):
    """How late the person knows what other players do, in the training of the person as well. Meanwhile it takes them
    to keep their speed and heading."""

    delay_s: Annotated[tuple[_DelayS, _DelayS], AfterValidator(ordered)] = (0.7, 1.5)
    """Range of the delay (uniform distribution, drawn for each drive), within 0 to 5 s. By default from the brake
    reaction to what is expected to that to a surprise (Green 2000)."""


class Perception(Document):
    """What a person sees of others, by their centres: directly within the field of view, and behind it in mirrors, or
    on foot with a turn of the head. No shoulder glance, and looking but failing to see, are habits of driving, not of
    learning: they do not apply in the training of the person, because a car that is not seen and does no harm teaches
    nothing. How far and how exactly a person sees is a limit of the body, and applies in training as well."""

    no_shoulder_glance_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person does not glance over the shoulder: a car beside the own one is then not
    seen between the field of view and the mirrors, within 3 m of the flank and back to 3 m behind the rear."""
    looked_but_failed_to_see_share: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the drives in which the person looks but fails to see: other cars are noticed only when they are
    near."""
    noticed_within_m: float | None = Field(None, gt=0.0, le=100.0)
    """In such a drive, other cars are seen only within this distance, from centre to centre."""
    range_m: float = Field(100.0, gt=0.0, le=100.0)
    """Other cars farther away than this, from centre to centre, are never seen."""
    field_of_view_deg: float = Field(180.0, gt=0.0, le=360.0)
    """Angle, ahead of the car and half of it to each side, within which the person sees directly."""
    distance_error: float = Field(0.05, ge=0.0, le=1.0)
    """Error in the estimated distance of other cars: standard deviation of the logarithm of the factor, so 0.1 is about
    10 %. The default is that of Treiber, Kesting and Helbing (2006)."""
    closing_error_per_s: float = Field(0.01, ge=0.0, le=1.0)
    """Error in the estimated closing speed of other cars: standard deviation, per distance. 0.01 is 0.3 m/s at 30 m.
    The default is that of Treiber, Kesting and Helbing (2006)."""

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


class Persona(Document):
    """A kind of driver: the payoff of equation 1 and human limits."""

    name: Name
    """The name of the persona in stages, arms and tables."""
    description: str = Field(min_length=10, max_length=2000)
    """The driver in one sentence."""
    sources: list[Source] = Field(min_length=1, max_length=50)
    """The evidence for the persona: at least one statistic."""
    unlike_people: list[UnlikePeople] = Field([], max_length=len(COMPARED_WITH_PEOPLE))
    """The figures in which the person is known not to be like people."""
    safety: Group = Group()
    operational: Group = Group()
    human: Human = Human()
    attention: AttentionLapses | None = None
    perception: Perception = Perception()
    reaction: ReactionTime = ReactionTime()
    actuators: CarUse | None = None
    decisions: Literal["mode", "sampled"] = "mode"
    """`mode`: always the most likely action of the policy. `sampled`: actions drawn from the policy's distribution."""

    @model_validator(mode="after")
    def _terms_are_valid(self) -> Persona:
        mistakes = [mistake for group in GROUPS for mistake in self._mistakes_in(group)]
        unique = {
            ("human.fuzzy", "name", "give each term its own name"): [each.name for each in self.human.fuzzy],
            ("unlike_people", "figure", "give one reason"): [each.figure for each in self.unlike_people],
        }
        mistakes += [
            (f"{table}[{k}].{key}", f"{name!r} occurs twice", remedy)
            for (table, key, remedy), names in unique.items()
            for k, name in enumerate(names)
            if name in names[:k]
        ]
        if mistakes:
            raise Mistakes(mistakes)
        if not any(getattr(self, group).terms for group in GROUPS) and not self.human.fuzzy:
            raise ValueError("the payoff has no terms: nothing could be learned from it")
        return self

    def _mistakes_in(self, group: str) -> Iterator[tuple[str, str, str]]:
        """Key, message and remedy of each mistake in the terms of a group."""
        known = [name for name, term in TERMS.items() if term.group == group]
        for name, value in getattr(self, group).terms.items():
            key, term = f"{group}.terms.{name}", TERMS.get(name)
            limits = [*value.limits] if isinstance(value, Parametrised) else [""]
            if term is None:
                yield key, f"unknown {group} term", nearest(name, known)
            elif term.group != group:
                yield key, f"belongs to the {term.group} terms", f"move it to [{term.group}.terms]"
            elif limits != [term.parameter]:
                remedy = f"{{ weight = ..., {term.parameter} = ... }}" if term.parameter else "a plain weight"
                yield key, "has the wrong form", f"give {remedy}"

    @property
    def payoff(self) -> Payoff:
        """Equation 1 of this persona."""
        terms = []
        for group in (self.safety, self.operational, self.human):
            for name, value in group.terms.items():
                if isinstance(value, Parametrised):
                    (limit,) = value.limits.values()
                    terms.append(Weighted(name=name, weight=value.weight, parameter=limit))
                else:
                    terms.append(Weighted(name=name, weight=value))
        fuzzy = {each.name: (each.weight, each.function) for each in self.human.fuzzy}
        alpha = {group: getattr(self, group).weight for group in GROUPS}
        return Payoff(alpha=alpha, terms=tuple(terms), fuzzy=fuzzy)

    @property
    def human_factors(self) -> HumanFactors:
        """The human limits as the game uses them."""
        return HumanFactors(
            attention=Attention(**_given(self.attention)) if self.attention else None,
            sight=Sight(**_given(self.perception)),
            delay_s=self.reaction.delay_s,
            actuator_shares=ActuatorShares(**_given(self.actuators)),
        )


def _given(table: Document | None) -> dict[str, Any]:
    """The keys of a table that have a value: the game's records have the same names, and the rest by default."""
    return {} if table is None else table.model_dump(exclude_none=True)
