"""The arm that matters most in a run: the first screen explains its failures, and its worst game is shown first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from harness.config.campaign import Competence
from harness.evaluation.comparisons.acceptance_checks import Check, worst_of_each
from harness.evaluation.strategies import NaiveEgo, NonEgoStrategy, SumoNonEgo, against_persona
from harness.reports.acceptance_wording import TITLES
from harness.reports.run_tables import RunTables


@dataclass(frozen=True, kw_only=True)
class Focus:
    """An arm, and why it matters."""

    arm: str
    ego: str
    """The ego in sentences, after "the"."""
    persona: str
    """The person of the arm; empty: nobody, or an ordinary driver."""
    happens: str
    """What happens in it, as the end of "See how …"."""
    failed: int
    """How many of its games the ego failed."""
    check: Check | None = None
    """The broken bound for which it is chosen."""
    is_ordinary: bool = False
    """Whether an ordinary driver has the person's place."""


def focus_of(tables: RunTables) -> Focus | None:
    """The arm of the naive or a last ego alone, or against an ordinary driver, if the ego is not competent there
    (`is_competent`); else that of the first broken bound that was measured, of one with failures if there is any; else
    the one with the most failures among the last egos against their personas; else among the naive ego's; else the
    first in which the ego fails alone, or against an ordinary driver. None: no ego fails, and no measured bound is
    broken."""
    without = list(_without_people(tables))
    incompetent = [each for each in without if not is_competent(*tables.counts_of(each.arm), tables)]
    return next(iter([*incompetent, *_with_people(tables), *without]), None)


def is_competent(failed: int, games: int, tables: RunTables) -> bool:
    """Whether an ego reaches its goal in the share of games that `[competence]` of the campaign asks of an ego alone:
    what people make it do matters more then."""
    asked = tables.manifest.get("campaign", {}).get("competence", {})
    return games - failed >= asked.get("ego_goal_share", Competence().ego_goal_share) * games


def _without_people(tables: RunTables) -> Iterator[Focus]:
    """The arms in which the naive and the last egos fail most often alone, and against an ordinary driver."""
    changed = f"{tables.change.made} ego"
    for ego, made in ((tables.naive, {NaiveEgo()}), (changed, {tables.last_ego(each) for each in tables.personas})):
        for is_ordinary, where in ((False, "fails alone"), (True, f"fails against an ordinary {tables.person}")):
            played = [name for name, arm in tables.arms.items() if arm.ego in made and _has(arm.non_ego, is_ordinary)]
            failed, arm = max(((tables.counts_of(name)[0], name) for name in played), default=(0, ""))
            if failed:
                happens = f"the {ego} {where}"
                yield Focus(arm=arm, ego=ego, persona="", happens=happens, failed=failed, is_ordinary=is_ordinary)


def _with_people(tables: RunTables) -> Iterator[Focus]:
    """The broken bounds, then the arms in which the last egos, and the naive ego, fail most often against people."""
    changed = f"{tables.change.made} ego"
    yield from sorted(_broken(tables), key=lambda each: not each.failed)
    last = [(against_persona(tables.last_ego(each), each).name, each) for each in tables.personas]
    naive = [(tables.arms_of("RQ1", each)[1], each) for each in tables.personas]
    for arms, ego, happens in (
        (last, changed, "the {ego} still fails against {persona}"),
        (naive, tables.naive, "{persona} makes the {ego} fail"),
    ):
        failed, arm, persona = max(
            ((tables.counts_of(arm)[0], arm, persona) for arm, persona in arms), default=(0, "", "")
        )
        if failed:
            words = happens.format(ego=ego, persona=persona)
            yield Focus(arm=arm, ego=ego, persona=persona, happens=words, failed=failed)


def _has(non_ego: NonEgoStrategy | None, is_ordinary: bool) -> bool:
    """Whether the person's place in an arm is an ordinary driver's, or else nobody's."""
    return isinstance(non_ego, SumoNonEgo) if is_ordinary else non_ego is None


def _broken(tables: RunTables) -> Iterator[Focus]:
    for check in worst_of_each(tables.acceptance or ()):
        if check.measured and not check.passed and len(tables.games_of(check.arm)):
            happens = f"the ego breaks the bound on {TITLES[check.bound]} against {check.persona}"
            failed, _ = tables.counts_of(check.arm)
            yield Focus(arm=check.arm, ego="ego", persona=check.persona, happens=happens, failed=failed, check=check)
