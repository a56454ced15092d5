"""Acceptance: does an ego keep the bounds of its campaign?

A bound is compared with the unfavourable end of a 95 % interval, not with the measured value: 0 failures in 10 games
are compatible with a failure rate of 31 %, and don't show that it is below 10 %.

docs/acceptance.md says in which games each bound is measured, and by which interval.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, Literal

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.arm_clauses import Beside, by_criterion, harm_clauses
from harness.evaluation.comparisons.comparison import games_by_arm, mean_interval, pairs_of
from harness.evaluation.comparisons.preventability import by_regulation
from harness.evaluation.gap_verdict import GapVerdict
from harness.evaluation.strategies import (
    Arm,
    EgoStrategy,
    NaiveEgo,
    PersonaNonEgo,
    RobustEgo,
    against_persona,
    egos_made_against,
    strategy_name,
)

JudgedEgo = Literal["last", "robust", "naive"]
LACKS_POWER = "the search ends below the ego's own strategy"
"""Why a gap that was measured bounds nothing."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One bound, judged for one persona and training seed in one arm."""

    bound: str
    """The key of the bound in the campaign."""
    persona: str
    seed: int
    arm: str
    value: float
    """The measured value; NaN where it could not be measured."""
    limit: float
    """The unfavourable end of its 95 % interval."""
    allowed: float
    """The bound."""
    games: int
    """The games, or pairs of games, in which it was measured."""
    detail: str = ""
    """What the value is made of, or why it was not measured, in words; empty: nothing to add."""

    @property
    def measured(self) -> bool:
        """Whether there is a value to judge."""
        return bool(np.isfinite(self.limit))

    @property
    def passed(self) -> bool:
        return self.measured and self.limit <= self.allowed


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """The tables of a run that bounds are judged by, and its planned arms by name."""

    arms: Mapping[str, Arm]
    episodes: pd.DataFrame
    summary: pd.DataFrame
    comparisons: pd.DataFrame
    gaps: pd.DataFrame
    preventability: pd.DataFrame | None = None
    """None: no failure was judged by reference drivers."""

    @cached_property
    def rows(self) -> Mapping[tuple[str, int], Mapping[Any, Any]]:
        return {(row["arm"], row["seed"]): row for row in self.summary.to_dict("records")}

    def unanswered(self, persona: str, seed: int) -> str:
        """Why a question about a persona is not answered; empty where it is."""
        asked = (self.comparisons["persona"] == persona) & (self.comparisons["seed"] == seed)
        return next((str(reason) for reason in self.comparisons.loc[asked, "reason"] if reason), "")


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The ego that is judged by one bound, about one persona and training seed."""

    ego: EgoStrategy
    bound: str
    allowed: float
    persona: str
    seed: int

    def check(self, arm: str, value: float = np.nan, limit: float = np.nan, games: int = 0) -> Check:
        """The check of what was measured in an arm; by default nothing was."""
        return Check(
            bound=self.bound,
            persona=self.persona,
            seed=self.seed,
            arm=arm,
            value=value,
            limit=limit,
            allowed=self.allowed,
            games=games,
        )


def judge(
    bounds: Mapping[str, float], judged: JudgedEgo, personas: Sequence[str], seeds: Sequence[int], evidence: Evidence
) -> list[Check]:
    """Every bound for every persona and training seed: one check for each arm that it is measured in.

    `bounds` are those of docs/acceptance.md with their values. A bound that can't be measured has a check with NaN,
    which does not pass; so has every bound about players of which a question is not answered.
    """
    checks: list[Check] = []
    for (bound, allowed), persona, seed in product(bounds.items(), personas, seeds):
        ego = judged_ego(judged, persona, seed, evidence)
        subject = Subject(ego=ego, bound=bound, allowed=allowed, persona=persona, seed=seed)
        reason = evidence.unanswered(persona, seed)
        for check in _checks(subject, evidence):
            checks.append(replace(check, value=np.nan, limit=np.nan, detail=reason) if reason else check)
    return checks


def worst_of_each(checks: Sequence[Check]) -> list[Check]:
    """For each bound and persona the check whose limit is farthest above the bound, or that could not be measured, in
    the order of the checks."""
    groups: dict[tuple[str, str], list[Check]] = {}
    for check in checks:
        groups.setdefault((check.bound, check.persona), []).append(check)
    return [max(group, key=lambda check: check.limit if check.measured else np.inf) for group in groups.values()]


def judged_ego(judged: JudgedEgo, persona: str, seed: int, evidence: Evidence) -> EgoStrategy:
    """The strategy that is judged: for `last` that of the last round that was assessed, or is planned, against the
    persona."""
    if judged == "robust":
        return RobustEgo()
    if judged == "naive":
        return NaiveEgo()
    arms = evidence.arms.values()
    planned = egos_made_against(arms, persona)
    assessed = egos_made_against((arm for arm in arms if (arm.name, seed) in evidence.rows), persona)
    return assessed[-1] if assessed else planned[0] if planned else NaiveEgo()


def _checks(subject: Subject, evidence: Evidence) -> Iterator[Check]:
    match subject.bound:
        case "failure_rate_alone":
            yield _rate("failure_rate", Arm(ego=subject.ego).name, subject, evidence)
        case "speed_loss_mps":
            yield _speed_loss(subject, evidence)
        case "gap_share":
            yield from _gap_shares(subject, evidence)
        case "preventable_failure_rate":
            yield from (_preventable(arm, subject, evidence) for arm in _arms_against(subject, evidence))
        case rate:
            for arm in _arms_against(subject, evidence):
                yield replace(_rate(rate, arm, subject, evidence), detail=_detail(arm, subject, evidence))


def _arms_against(subject: Subject, evidence: Evidence) -> list[str]:
    """The arms of the ego against a non-ego of the persona, of any round."""
    arms = [
        arm.name
        for arm in evidence.arms.values()
        if arm.ego == subject.ego
        and isinstance(arm.non_ego, PersonaNonEgo)
        and arm.non_ego.persona == subject.persona
        and arm.non_ego.borrowed is None
        and arm.best_response_of is None
    ]
    return arms or [against_persona(subject.ego, subject.persona).name]


def _rate(column: str, arm: str, subject: Subject, evidence: Evidence) -> Check:
    row = evidence.rows.get((arm, subject.seed))
    if row is None:
        return subject.check(arm)
    return subject.check(arm, row[column], row[f"{column}_high"], row["episodes"] - row["errors"])


def _detail(arm: str, subject: Subject, evidence: Evidence) -> str:
    """What a rate in an arm is made of; for harm to others also what it is beside the naive ego."""
    row = evidence.rows.get((arm, subject.seed))
    if row is None or not np.isfinite(row[subject.bound]):
        return ""
    match subject.bound:
        case "near_miss_rate":
            return by_criterion([row])
        case "harm_to_others_rate":
            egos = [Beside("this ego", [row])]
            naive = evidence.rows.get((against_persona(NaiveEgo(), subject.persona).name, subject.seed))
            if naive is not None and subject.ego != NaiveEgo():
                egos.append(Beside("the naive ego", [naive]))
            return "; ".join(harm_clauses(*egos).values())
        case _:
            return ""


def _preventable(arm: str, subject: Subject, evidence: Evidence) -> Check:
    failures, judged = _rate("failure_rate", arm, subject, evidence), evidence.preventability
    if judged is None:
        return subject.check(arm)
    for row in by_regulation(judged, arm):
        if row["seed"] == subject.seed:
            return subject.check(arm, row["from_start_rate"], row["from_start_rate_high"], failures.games)
    return failures if failures.value == 0.0 else subject.check(arm)


def _speed_loss(subject: Subject, evidence: Evidence) -> Check:
    naive, judged = (against_persona(ego, subject.persona).name for ego in (NaiveEgo(), subject.ego))
    before, after, _ = pairs_of(games_by_arm(evidence.episodes), subject.seed, naive, judged, ["ego_mean_speed_mps"])
    losses = (before - after)[:, 0]
    value = float(losses.mean()) if len(losses) else np.nan
    _, high = mean_interval(losses)
    return subject.check(judged, value, high if np.isfinite(high) else value, len(losses))


def _gap_shares(subject: Subject, evidence: Evidence) -> Iterator[Check]:
    ego, found = strategy_name(subject.ego), False
    for row in evidence.gaps.to_dict("records"):
        if (row["role"], row["ego"], row["persona"], row["seed"]) == ("ego", ego, subject.persona, subject.seed):
            scale, found = abs(row["payoff"]) or np.nan, True
            high = row["ci_high"] if np.isfinite(row["ci_high"]) else row["gap"]
            measured = subject.check(f"{ego}_vs_{row['non_ego']}", row["gap"] / scale, high / scale, row["pairs"])
            lacks_power = row["verdict"] == GapVerdict.LACKS_POWER
            yield replace(measured, limit=np.nan, detail=LACKS_POWER) if lacks_power else measured
    if not found:
        yield subject.check(against_persona(subject.ego, subject.persona).name)
