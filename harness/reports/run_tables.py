"""The contents of a run's report: its manifest and its tables, and what the page looks up in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import pandas as pd

from harness.config.campaign import LEARNED, ego_called
from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.comparisons.preventability import by_regulation
from harness.evaluation.competence import FINISHED
from harness.evaluation.game_theory.findings import GameFindings
from harness.evaluation.rule_book.causes import cause_lines
from harness.evaluation.start_space import Boundary
from harness.evaluation.strategies import (
    NAIVE_ALONE,
    NAIVE_VS_SUMO,
    Arm,
    EgoStrategy,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    Strategy,
    against_persona,
    egos_made_against,
    stage_id,
)
from harness.evaluation.tables import table_of
from harness.evaluation.unplayed_games import were_played

Row = Mapping[Any, Any]
"""A row of a table, by column."""
QUESTIONS = {
    "RQ1": "Does this {person} cause failures?",
    "RQ2": "Does {doing} help?",
}


class Change(NamedTuple):
    """What round 2 makes of the ego."""

    made: str
    """The ego of round 2 in sentences."""
    doing: str
    """What round 2 does, in sentences."""
    in_short: str
    """The same in a heading."""
    ego: Callable[[str], EgoStrategy]
    """The ego of round 2 as a strategy, by the persona that it meets."""


RETRAINED = Change("retrained", "retraining", "retraining", lambda persona: RetrainedEgo(against=persona))
RECONFIGURED = Change(
    "reconfigured", "reconfiguration", "reconfiguration", lambda persona: ReconfiguredEgo(against=persona)
)
ROBUST = Change("robust", "retraining against several personas", "retraining", lambda persona: RobustEgo())


def _empty(name: str) -> Callable[[], pd.DataFrame]:
    return lambda: table_of(name)


@dataclass(frozen=True, kw_only=True)
class RunTables:
    """What a report is made of. The frames are tables of `harness.evaluation.columns.TABLES`."""

    manifest: Mapping[str, Any]
    """The content of manifest.json."""
    arms: Mapping[str, Arm] = field(default_factory=dict)
    """The planned arms by name."""
    strategies: Mapping[str, Strategy] = field(default_factory=dict)
    """The strategies that are trained, by name."""
    episodes: pd.DataFrame = field(default_factory=_empty("episodes"))
    summary: pd.DataFrame = field(default_factory=_empty("summary"))
    comparisons: pd.DataFrame = field(default_factory=_empty("comparisons"))
    over_trainings: pd.DataFrame = field(default_factory=_empty("over_trainings"))
    """Empty: the campaign has too few training seeds."""
    training: pd.DataFrame = field(default_factory=_empty("training"))
    reconfiguration: pd.DataFrame = field(default_factory=_empty("reconfiguration"))
    """Empty: the report has no section on searches."""
    selections: pd.DataFrame = field(default_factory=_empty("selections"))
    """Empty: the campaign has no rounds after the paper's."""
    shields: pd.DataFrame = field(default_factory=_empty("shields"))
    """Empty: the ego has no shield."""
    perception: pd.DataFrame = field(default_factory=_empty("perception"))
    """Empty: the ego has no perception errors."""
    populations: pd.DataFrame = field(default_factory=_empty("populations"))
    causes: pd.DataFrame = field(default_factory=_empty("causes"))
    conduct: pd.DataFrame = field(default_factory=_empty("conduct"))
    starts: pd.DataFrame = field(default_factory=pd.DataFrame)
    """The quantities that differ between the starts (`start_space.start_quantities`), by episode."""
    boundaries: Sequence[Boundary] = ()
    """Those that `harness minimise` found."""
    realism: pd.DataFrame = field(default_factory=_empty("realism"))
    attribution: pd.DataFrame = field(default_factory=_empty("attribution"))
    """Empty: the report has no section on traits."""
    undecided: pd.DataFrame = field(default_factory=_empty("undecided"))
    reference_drivers: pd.DataFrame = field(default_factory=_empty("reference_drivers"))
    takeovers: pd.DataFrame = field(default_factory=_empty("takeovers"))
    preventability: pd.DataFrame = field(default_factory=_empty("preventability"))
    """Empty: no failure was judged by reference drivers."""
    manoeuvres: pd.DataFrame = field(default_factory=_empty("manoeuvres"))
    game: GameFindings | None = None
    """None: the report has no section on the game."""
    non_ego_drives: bool = True
    """Whether the people are drivers; else they are on foot, on bicycles or on e-scooters."""
    acceptance: Sequence[Check] | None = None
    """The checks of the campaign's bounds; None: it has none."""
    replays: Sequence[str] = ()
    """Names of the folders under `replays/`, in any order."""
    is_from_tables: bool = False
    """Whether the run is published as its tables: there is no game to watch."""

    @property
    def campaign(self) -> Mapping[str, Any]:
        return self.manifest.get("campaign", {})

    @property
    def stages(self) -> Mapping[str, Mapping[str, Any]]:
        return self.manifest.get("stages", {})

    @property
    def unfinished(self) -> Mapping[str, Mapping[str, Any]]:
        return {name: stage for name, stage in self.stages.items() if stage.get("status") not in FINISHED}

    @property
    def personas(self) -> list[str]:
        """Every persona that the manifest or a table names, in order of first appearance; without the baseline, unless
        it is a persona of the campaign."""
        own, baseline = self.manifest.get("personas", ()), self.manifest.get("baseline")
        names = dict.fromkeys((*own, *self.comparisons["persona"], *self.summary["persona"]))
        return [name for name in names if name and (name != baseline or name in own)]

    @cached_property
    def seeds(self) -> list[int]:
        """Every training seed that the manifest or a table names."""
        return sorted({*self.manifest.get("seeds", ()), *self.summary["seed"], *self.comparisons["seed"]})

    @property
    def several_seeds(self) -> bool:
        """Whether texts name the seed."""
        return len(self.seeds) > 1

    @property
    def significance(self) -> float | None:
        return self.campaign.get("assessment", {}).get("significance")

    @property
    def crowds(self) -> Mapping[str, Sequence[str]]:
        """The personas of each crowd, in the order of the scene's people."""
        return crowds_of(self.manifest)

    @property
    def person(self) -> str:
        """What a persona is in sentences, after "this"."""
        return "driver" if self.non_ego_drives else "person"

    @property
    def naive(self) -> str:
        """The ego before round 2 in sentences, after "the"."""
        return ego_called(self._driver)

    @property
    def _driver(self) -> str:
        return self.campaign.get("ego", {}).get("driver", LEARNED)

    @property
    def change(self) -> Change:
        """What round 2 makes of the ego, if it is played."""
        egos = {type(arm.ego) for arm in self.arms.values()}
        if ReconfiguredEgo in egos:
            return RECONFIGURED
        return ROBUST if RobustEgo in egos and RetrainedEgo not in egos else RETRAINED

    @cached_property
    def played(self) -> pd.DataFrame:
        return self.episodes[were_played(self.episodes)]

    @cached_property
    def rates(self) -> Mapping[tuple[str, int], Row]:
        return {(row["arm"], row["seed"]): row for row in self.summary.to_dict("records")}

    def rates_of(self, arm: str) -> dict[int, Row]:
        """The arm's rows of `summary` by seed, where there are games that could be played."""
        rows = {seed: self.rates.get((arm, seed)) for seed in self.seeds}
        return {seed: row for seed, row in rows.items() if row is not None and played(row)}

    def counts_of(self, arm: str) -> tuple[int, int]:
        """How many games of an arm the ego failed, and how many could be played, over all training seeds. Games without
        a trained player are the same for each seed, and count once."""
        is_untrained = self._driver != LEARNED and arm in (NAIVE_ALONE.name, NAIVE_VS_SUMO.name)
        rows = list(self.rates_of(arm).values())[: 1 if is_untrained else None]
        return sum(map(failures, rows)), sum(map(played, rows))

    def games_of(self, arm: str) -> pd.DataFrame:
        return self.played[self.played["arm"] == arm]

    def arms_of(self, question: str, persona: str) -> tuple[str, str]:
        """Baseline and treatment of a question about a persona."""
        naive = against_persona(NaiveEgo(), persona).name
        if question == "RQ1":
            return NAIVE_ALONE.name, naive
        return naive, against_persona(self.change.ego(persona), persona).name

    def last_ego(self, persona: str) -> EgoStrategy:
        """The ego of the last round that was played against a persona's non-ego of round 1."""
        met = PersonaNonEgo(persona=persona)
        played = [arm for name, arm in self.arms.items() if self.rates_of(name)]
        made = egos_made_against((arm for arm in played if arm == Arm(ego=arm.ego, non_ego=met)), persona)
        return made[-1] if made else self.change.ego(persona)

    def tests_of(self, question: str, persona: str) -> list[Row]:
        rows = self.comparisons
        return rows[(rows["question"] == question) & (rows["persona"] == persona)].to_dict("records")

    def over_trainings_of(self, question: str, persona: str) -> Row | None:
        """The row of `over_trainings` on a question about a persona; None: the campaign has too few training seeds."""
        rows = self.over_trainings
        found = rows[(rows["question"] == question) & (rows["persona"] == persona)].to_dict("records")
        return found[0] if found else None

    def asked(self, question: str, persona: str) -> list[int]:
        """The training seeds of which a question is asked: its treatment is planned, or it is compared."""
        _, treatment = self.arms_of(question, persona)
        compared = {row["seed"] for row in self.tests_of(question, persona)}
        return [seed for seed in self.seeds if stage_id(treatment, seed) in self.stages or seed in compared]

    def of_own_traits(self, rows: pd.DataFrame) -> pd.DataFrame:
        """The rows of a table in whose arms people have their own traits."""
        return rows[~rows["arm"].isin([name for name, arm in self.arms.items() if arm.is_of_a_trait])]

    def causes_of(self, question: str, persona: str) -> tuple[str, ...]:
        """Why the ego failed against a persona in the arm that a question is about, a line for each kind of cause."""
        _, treatment = self.arms_of(question, persona)
        return tuple(cause_lines(self.causes[self.causes["arm"] == treatment]))

    def prevented_in(self, arm: str) -> list[Mapping[Any, Any]]:
        """What the driver of the regulation prevents in an arm: the rows of preventability.csv, by training seed."""
        return by_regulation(self.preventability, arm)

    def who(self, persona: str) -> str:
        """What the ego meets, if it is not one driver with a persona; else empty."""
        if persona in self.crowds:
            return f"the crowd {persona}"
        return "" if self.non_ego_drives else f"the {persona}"


def crowds_of(manifest: Mapping[str, Any]) -> Mapping[str, Sequence[str]]:
    """The personas of each crowd of a manifest, in the order of the scene's people."""
    return {each["name"]: each["personas"] for each in manifest.get("campaign", {}).get("crowd", ())}


def played(row: Row | None) -> int:
    """Games of an arm that could be played; none when the arm has no row."""
    return 0 if row is None else row["episodes"] - row["errors"]


def failures(row: Row) -> int:
    """How many games of the arm the ego failed; 0 where no game with an ego could be played."""
    return sum(int(row[each]) for each in ("collisions", "rails", "timeouts") if pd.notna(row[each]))


def failures_of(row: Row) -> str:
    """E.g. "25 of 100"."""
    return f"{failures(row)} of {played(row)}"
