"""The meaning of a persona's document: its terms, functions and sample drives, and sentences about them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from harness.config.persona import Persona
from harness.game.human_factors import BLIND_BEHIND_M, BLIND_BESIDE_M, PERSISTENCE_S
from harness.game.lapses import NOTICED_TTC_S, Attention
from harness.game.payoff_terms import GROUPS
from harness.reports.persona.drives import (
    DRIFT_SPEED_MPS,
    DRIVE_S,
    WHEELBASE_M,
    SampleDrive,
    drift_m,
    free_share,
    lapsed_share,
    lapses_per_minute,
    sample,
)
from harness.reports.persona.worth import PayoffFunction, TermExample, payoff_functions, term_examples

NEAR_M = 20.0
"""The distance at which errors are stated."""
FORMULA = "payoff = α₀ · Σ safety + α₁ · Σ operational + α₂ · Σ human, summed over every step of the game"
WANTS, ATTENDS, DECIDES = "What this person wants", "How this person attends", "How this person decides"
NO_GLANCE_MARK = " (no shoulder glance)"
"""Marks a drive in which the person does not glance over the shoulder."""
COLLISION_IS_FREE = "A collision itself costs nothing."
NO_LAPSES = "Attention never lapses."
IN_A_LAPSE = {
    "released": "In a lapse the person releases pedals and wheel.",
    "held": (
        "In a lapse the person holds the pedals, and the wheel follows the road. The lapse ends where the time to "
        f"collision with the vehicle ahead is {NOTICED_TTC_S:g} s or less."
    ),
}
ALWAYS_GLANCES = "The person glances over the shoulder in every drive."
AFTER_A_LAPSE = "After a lapse, the others are taken for the same time to move on as before it."
UNIMPAIRED_IN_TRAINING = (
    "While the person itself is trained, it glances over the shoulder and sees every vehicle; all else is as it drives."
)
SAMPLED = "Actions are sampled from the policy's distribution, so no two drives are the same."
MOST_LIKELY = "The action is always the policy's most likely one."


@dataclass(frozen=True, kw_only=True)
class PersonaProfile:
    """A persona, and what is computed from its document; sentences for the page and the terminal."""

    persona: Persona
    terms: Sequence[TermExample]
    functions: Sequence[PayoffFunction]
    drives: Sequence[SampleDrive]
    wants: Sequence[str]
    """The payoff's terms compared with each other."""
    attends: Sequence[str]
    """Attention, sight, perception, reaction, and how much of the car the person uses."""
    decides: str
    """How actions follow from the person's policy."""

    @property
    def payoffs(self) -> Iterator[tuple[str, str, str, str, str]]:
        """The rows of the payoff's table: term, group, alpha and weight, for what it counts, and how much."""
        for each in self.terms:
            counted = f"{each.meaning}, {each.limit}" if each.limit else each.meaning
            weight, worth = f"{each.alpha:g} × {each.weight:g}", f"{number(each.worth)} {each.moment}"
            yield each.name, each.group, weight, counted, worth
        for function in self.functions:
            weight = f"{function.alpha:g} × {function.weight:g}"
            worth = f"{number(function.worst[0])} to {number(function.best[0])} per second"
            yield function.name, "human", weight, f"a function of {function.quantity}, below", worth


def persona_profile(persona: Persona) -> PersonaProfile:
    """The profile of a persona; equal documents give equal profiles."""
    terms, functions, drives = term_examples(persona), payoff_functions(persona), sample(persona)
    return PersonaProfile(
        persona=persona,
        terms=terms,
        functions=functions,
        drives=drives,
        wants=list(_wants(persona, terms)),
        attends=[*_attention(persona, drives), *_blind_spot(persona, drives), *_body(persona)],
        decides=SAMPLED if persona.decisions == "sampled" else MOST_LIKELY,
    )


def number(value: float) -> str:
    """A payoff with its sign, e.g. "+1.5" or "−10"; empty when it is NaN."""
    if math.isnan(value):
        return ""
    text = f"{abs(value):.3g}"
    return text if text == "0" else ("+" if value > 0 else "\N{MINUS SIGN}") + text


def percent(share: float) -> str:
    """E.g. "55 %"; a share between 0 and 1 % is "under 1 %"."""
    return "under 1 %" if 0.0 < share < 0.01 else f"{share * 100:.0f} %"


def _wants(persona: Persona, terms: Sequence[TermExample]) -> Iterator[str]:
    worth = {each.name: each.worth for each in terms}
    collision, progress, goal = (worth.get(name, 0.0) for name in ("collision", "progress", "goal"))
    if collision == 0.0:
        yield COLLISION_IS_FREE
    elif progress:
        yield f"A collision costs as much as {-100.0 * collision / progress:.3g} m of progress earn."
    elif goal:
        yield f"A collision costs {-collision / goal:.3g} times the payoff of the goal."
    for group in GROUPS:
        has_terms = any(each.group == group for each in terms) or (group == "human" and persona.payoff.fuzzy)
        if has_terms and persona.payoff.alpha[group] == 0.0:
            yield f"The {group} terms have no effect: their alpha is 0."


def function_in_words(function: PayoffFunction) -> str:
    """Where a function is greatest and least."""
    (most, *best), (least, *worst) = function.best, function.worst
    if most == least:
        return f"{number(most)} per second everywhere."
    return (
        f"Greatest payoff {_stretch(best, function.unit)}: {number(most)} per second. "
        f"Least payoff {_stretch(worst, function.unit)}: {number(least)} per second."
    )


def _stretch(ends: Sequence[float], unit: str) -> str:
    low, high = ends
    unit = f" {unit}" if unit else ""
    if math.isinf(low):
        return f"up to {high:.3g}{unit}"
    if math.isinf(high):
        return f"from {low:.3g}{unit} on"
    return f"at {low:.3g}{unit}" if low == high else f"from {low:.3g} to {high:.3g}{unit}"


def length_of_lapses(attention: Attention) -> str:
    """How long lapses of attention are, e.g. "4 to 6 s"."""
    shortest, longest = attention.lapse_s
    length = f"{shortest:g} s" if shortest == longest else f"{shortest:g} to {longest:g} s"
    if attention.lapse_distribution == "lognormal":
        return f"{attention.mean_lapse_s:.2g} s on average, {length} in the middle 90 %"
    return length


def _attention(persona: Persona, drives: Sequence[SampleDrive]) -> Iterator[str]:
    attention = persona.human_factors.attention
    if attention is None:
        yield NO_LAPSES
        return
    yield (
        f"Eyes off the road {percent(lapsed_share(attention))} of the time, in the long run: "
        f"lapses of {length_of_lapses(attention)}, "
        f"with {attention.mean_attentive_s:g} s of attention between them on average; "
        f"{lapses_per_minute(attention):.2g} lapses per minute."
    )
    drawn_share = sum(each.lapsed_share for each in drives) / len(drives)
    yield (
        f"In the {len(drives)} sample drives: {percent(drawn_share)}. Of drives of {DRIVE_S:g} s, "
        f"{percent(free_share(attention))} have no lapse."
    )
    yield IN_A_LAPSE[attention.controls]
    if attention.bump_steering_sd_rad:
        lapse_s = attention.mean_lapse_s
        yield (
            f"At {DRIFT_SPEED_MPS * 3.6:.0f} km/h on a straight road, a car of {WHEELBASE_M:g} m wheelbase drifts in "
            f"{lapse_s:.2g} s by {drift_m(attention.bump_steering_sd_rad, lapse_s):.2g} m (standard deviation)."
        )


def _blind_spot(persona: Persona, drives: Sequence[SampleDrive]) -> Iterator[str]:
    sight = persona.human_factors.sight
    if sight.no_shoulder_glance_share == 0.0:
        yield ALWAYS_GLANCES
        return
    count = sum(not each.shoulder_glance for each in drives)
    yield (
        f"No glance over the shoulder in {percent(sight.no_shoulder_glance_share)} of the drives "
        f"({count} of the {len(drives)} sample drives): a vehicle is not seen when its centre is beside the person's "
        f"car, within {BLIND_BESIDE_M:g} m, or behind its rear within {BLIND_BEHIND_M:g} m."
    )


def _body(persona: Persona) -> Iterator[str]:
    human_factors = persona.human_factors
    sight = human_factors.sight
    if sight.looked_but_failed_to_see_share:
        yield (
            f"In {percent(sight.looked_but_failed_to_see_share)} of the drives the person looks but fails to see: "
            f"a vehicle is noticed within {sight.noticed_within_m:g} m only."
        )
    if sight.field_of_view_deg < 360.0:
        yield f"The field of view is {sight.field_of_view_deg:g} degrees; mirrors show what is behind it."
    if math.isfinite(sight.range_m):
        yield f"Vehicles more than {sight.range_m:g} m away are never seen."
    if sight.distance_error:
        low, high = (math.exp(sign * sight.distance_error) for sign in (-1, 1))
        yield f"Two thirds of the time, a distance of 10 m is perceived as {10 * low:.3g} to {10 * high:.3g} m."
    if sight.closing_error_per_s:
        error_mps = NEAR_M * sight.closing_error_per_s
        yield f"At {NEAR_M:g} m, the error of closing speeds is {error_mps:.2g} m/s (standard deviation)."
    if sight.distance_error or sight.closing_error_per_s:
        yield f"An error of perception lasts for about {PERSISTENCE_S:g} s."
    shortest, longest = human_factors.delay_s
    if longest > 0.0:
        length = f"{shortest:g}" if shortest == longest else f"{shortest:g} to {longest:g}"
        speed, distance_m = f"{DRIFT_SPEED_MPS * 3.6:.0f} km/h", DRIFT_SPEED_MPS * longest
        yield f"What others do is known {length} s later: at {speed} after up to {distance_m:.2g} m."
        if human_factors.attention is not None:
            yield AFTER_A_LAPSE
    uses = human_factors.actuator_shares
    shares = {"acceleration": uses.throttle_share, "braking": uses.braking_share, "steering": uses.steering_share}
    if used := [f"{percent(share)} of the {name}" for name, share in shares.items() if share < 1.0]:
        yield f"The person uses {', '.join(used)} of the car."
    if human_factors.with_open_eyes != human_factors:
        yield UNIMPAIRED_IN_TRAINING
