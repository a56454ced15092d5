"""What a persona's document means: its terms, functions and drives, and what they say in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from harness.config.persona import Persona
from harness.game.payoff import GROUPS
from harness.reports.persona.drives import (
    DRIFT_SPEED_MPS,
    DRIVE_S,
    WHEELBASE_M,
    SampleDrive,
    drift_m,
    free_share,
    lapsed_share,
    lapses_per_minute,
    mean_lapse_s,
    sample,
)
from harness.reports.persona.worth import Counted, Drawn, counted, drawn

SHOWN = (
    "name",
    "description",
    "sources",
    *GROUPS,
    "attention",
    "perception",
    "reaction",
    "actuators",
    "decisions",
)
"""The tables and keys of a persona that its portrait shows: all there are."""
NEAR_M = 20.0
"""A distance to picture errors at."""
FORMULA = "payoff = α₀ · Σ safety + α₁ · Σ operational + α₂ · Σ human, added up over every step of the game"


@dataclass(frozen=True)
class PersonaProfile:
    """A persona, and what follows from its document."""

    persona: Persona
    terms: Sequence[Counted]
    functions: Sequence[Drawn]
    drives: Sequence[SampleDrive]


def persona_profile(persona: Persona) -> PersonaProfile:
    """A persona's portrait; equal documents give equal ones."""
    return PersonaProfile(persona, counted(persona), drawn(persona), sample(persona))


def number(value: float) -> str:
    """A payoff with its sign, e.g. "+1.5" or "−10"; empty: not known."""
    if math.isnan(value):
        return ""
    text = f"{abs(value):.3g}"
    return text if text == "0" else ("+" if value > 0 else "\N{MINUS SIGN}") + text


def percent(share: float) -> str:
    """E.g. "55 %"; what is rare, but not never, is "under 1 %"."""
    return "under 1 %" if 0.0 < share < 0.01 else f"{share * 100:.0f} %"


def wants(portrait: PersonaProfile) -> Iterator[str]:
    """What the payoff's terms come to, against each other."""
    worth = {each.name: each.worth for each in portrait.terms}
    collision, progress, goal = (worth.get(name, 0.0) for name in ("collision", "progress", "goal"))
    if collision == 0.0:
        yield "A collision costs nothing of itself."
    elif progress:
        yield f"A collision costs as much as {-100.0 * collision / progress:.3g} m of progress are worth."
    elif goal:
        yield f"A collision costs as much as {-collision / goal:.3g} times the goal is worth."
    for group in GROUPS:
        named = any(each.group == group for each in portrait.terms) or (group == "human" and portrait.functions)
        if named and portrait.persona.payoff.alpha[group] == 0.0:
            yield f"The {group} terms count nothing: their alpha is 0."


def function_in_words(drawn: Drawn) -> str:
    """Where a function is worth most and least."""
    (most, *best), (least, *worst) = drawn.best, drawn.worst
    if most == least:
        return f"Worth {number(most)} per second everywhere."
    return (
        f"Worth most {_stretch(best, drawn.unit)}: {number(most)} per second. "
        f"Worth least {_stretch(worst, drawn.unit)}: {number(least)} per second."
    )


def _stretch(ends: Sequence[float], unit: str) -> str:
    low, high = ends
    unit = f" {unit}" if unit else ""
    if math.isinf(low):
        return f"up to {high:.3g}{unit}"
    if math.isinf(high):
        return f"from {low:.3g}{unit} on"
    return f"at {low:.3g}{unit}" if low == high else f"from {low:.3g} to {high:.3g}{unit}"


def attends(portrait: PersonaProfile) -> Iterator[str]:
    """When attention lapses, and what the car does then."""
    attention = portrait.persona.human_factors.attention
    if attention is None:
        yield "Attention never lapses."
        return
    lapse_s = mean_lapse_s(attention)
    shortest, longest = attention.lapse_s
    length = f"{shortest:g} s" if shortest == longest else f"{shortest:g} to {longest:g} s"
    yield (
        f"Eyes off the road {percent(lapsed_share(attention))} of the time, in the long run: lapses of {length}, "
        f"between them {attention.mean_attentive_s:g} s of attention on average; "
        f"{lapses_per_minute(attention):.2g} lapses a minute."
    )
    drawn_share = sum(each.lapsed_share for each in portrait.drives) / len(portrait.drives)
    yield (
        f"In the {len(portrait.drives)} drives drawn here {percent(drawn_share)}. Of drives of {DRIVE_S:g} s, "
        f"{percent(free_share(attention))} are without a lapse."
    )
    yield "In a lapse pedals and wheel are let go. " + _drifts(attention.crown_rad, attention.bumps_rad, lapse_s)


def _drifts(crown_rad: float, bumps_rad: float, lapse_s: float) -> str:
    if crown_rad == bumps_rad == 0.0:
        return "The wheel then stands straight."
    right_m, spread_m = drift_m(crown_rad, lapse_s), drift_m(bumps_rad, lapse_s)
    where = f"{right_m:.2g} m to the right" if right_m else "on average where it was"
    spread = f" (standard deviation {spread_m:.2g} m)" if spread_m else ""
    return (
        f"At {DRIFT_SPEED_MPS * 3.6:.0f} km/h on a straight road a car of {WHEELBASE_M:g} m wheelbase is then, after "
        f"{lapse_s:g} s, {where}{spread}."
    )


def sees(portrait: PersonaProfile) -> Iterator[str]:
    """Who is overlooked, and how often."""
    overlooking = portrait.persona.human_factors.no_blind_spot_check
    if overlooking.share == 0.0:
        yield "Nobody is overlooked."
        return
    ahead_m = overlooking.ahead_m
    who = f"is not at least {ahead_m:g} m ahead of" if ahead_m >= 0.0 else f"is more than {-ahead_m:g} m behind"
    count = sum(each.overlooks for each in portrait.drives)
    yield (
        f"In {percent(overlooking.share)} of the drives, others whose centre {who} its own are not seen: in {count} of "
        f"the {len(portrait.drives)} drawn here."
    )


def body(portrait: PersonaProfile) -> Iterator[str]:
    """How far and how exactly the person sees, how late its decisions count, how much of the car it uses."""
    human_factors = portrait.persona.human_factors
    sight, missing = human_factors.sight, human_factors.looked_but_failed_to_see
    if missing.share:
        yield (
            f"In {percent(missing.share)} of the drives it looks and fails to see: others are noticed within "
            f"{missing.within_m:g} m only."
        )
    if math.isfinite(sight.range_m):
        yield f"Others more than {sight.range_m:g} m away are never seen."
    if sight.distance_error:
        low, high = (math.exp(sign * sight.distance_error) for sign in (-1, 1))
        yield f"Two thirds of the time, 10 m to another are taken for {10 * low:.3g} to {10 * high:.3g} m."
    if sight.closing_error_per_s:
        off_mps = NEAR_M * sight.closing_error_per_s
        yield f"At {NEAR_M:g} m, closing speeds are off by {off_mps:.2g} m/s (standard deviation)."
    if sight.distance_error or sight.closing_error_per_s:
        yield f"What is misjudged stays so for {sight.error_s:g} s or so."
    yield from _slowly(human_factors.reaction.delay_s, human_factors.attention is not None)
    uses = human_factors.actuator_shares
    shares = {"acceleration": uses.throttle, "braking": uses.braking, "steering": uses.steering}
    if used := [f"{percent(share)} of its {name}" for name, share in shares.items() if share < 1.0]:
        yield f"Of what the car can do it uses {', '.join(used)}."
    if human_factors.looked_but_failed_to_see.share or human_factors.no_blind_spot_check.share:
        yield "While the person itself is trained, nobody is overlooked or missed; all else is as in driving."


def _slowly(delay_s: tuple[float, float], lapses: bool) -> Iterator[str]:
    shortest, longest = delay_s
    if longest == 0.0:
        return
    length = f"{shortest:g}" if shortest == longest else f"{shortest:g} to {longest:g}"
    way_m = DRIFT_SPEED_MPS * longest
    yield f"Decisions count {length} s later: at {DRIFT_SPEED_MPS * 3.6:.0f} km/h after up to {way_m:.2g} m."
    if lapses:
        yield "After a lapse the car is let go for as long again."


def decides(portrait: PersonaProfile) -> str:
    """How the person makes its policy's decisions."""
    if portrait.persona.decisions == "sampled":
        return "Varies: actions are drawn from what its policy holds likely, so no two drives are alike."
    return "Always takes the action that its policy holds most likely."
