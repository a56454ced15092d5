"""The arm that matters most in a run: the first screen explains its failures, and its worst game is shown first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from harness.evaluation.comparisons.acceptance_checks import Check, worst_of_each
from harness.evaluation.strategies import NAIVE_ALONE, NAIVE_VS_SUMO, against_persona
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


def focus_of(tables: RunTables) -> Focus | None:
    """The arm of the naive ego alone, or against an ordinary driver, if the ego fails in it; else that of the first
    broken bound that was measured; else the one with the most failures among the last egos against their personas; else
    among the naive ego's. None: no ego fails, and no measured bound is broken."""
    return next(_candidates(tables), None)


def _candidates(tables: RunTables) -> Iterator[Focus]:
    ordinary = f"fails against an ordinary {tables.person}"
    for arm, where in ((NAIVE_ALONE.name, "fails alone"), (NAIVE_VS_SUMO.name, ordinary)):
        if failed := tables.counts_of(arm)[0]:
            yield Focus(arm=arm, ego=tables.naive, persona="", happens=f"the {tables.naive} {where}", failed=failed)
    for check in worst_of_each(tables.acceptance or ()):
        if check.measured and not check.passed and len(tables.games_of(check.arm)):
            happens = f"the ego breaks the bound on {TITLES[check.bound]} against {check.persona}"
            failed, _ = tables.counts_of(check.arm)
            yield Focus(arm=check.arm, ego="ego", persona=check.persona, happens=happens, failed=failed, check=check)
    changed = f"{tables.change.made} ego"
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
