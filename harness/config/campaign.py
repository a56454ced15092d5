"""A campaign: ego, personas and scene, how the players are trained, and how they are assessed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from harness.config.ego_perception import EgoPerception
from harness.config.scene import Name, Share
from harness.config.toml_reading import PATH, TABLE, Document, Mistakes
from harness.config.training import NaiveTraining, NonEgoTraining, Reconfiguration, Retraining, Training
from harness.game.perception_errors import PerceptionErrors
from harness.game.roles import MOST_PEOPLE

LEARNED, SUMO = "learned", "sumo"  # drivers of an ego that have a name
SHIPPED = "shipped"  # in `retraining.against`: the people of the scene
TRAINING_TABLES = ("training", "naive_training", "non_ego_training", "retraining")

Seed = Annotated[int, Field(ge=0, lt=2**31)]
CampaignName = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
DocumentPath = Annotated[str, Field(min_length=1, max_length=500, pattern=r"^[^\x00-\x1f]*$")]
PathOrTable = Annotated[
    Annotated[DocumentPath, Tag(PATH)] | Annotated[EgoPerception, Tag(TABLE)],
    Discriminator(lambda value: TABLE if isinstance(value, dict | EgoPerception) else PATH),
]


def ego_called(driver: str) -> str:
    """The ego before round 2 in sentences, after "the": "naive ego" if the campaign trains it, else by its driver."""
    if driver == LEARNED:
        return "naive ego"
    if driver == SUMO:
        return "ego driven by SUMO"
    return f"ego {Path(driver).name.removesuffix('.toml')}"


class Ego(Document):
    """The vehicle under study."""

    driver: DocumentPath = LEARNED
    """`learned`: trained by the campaign. `sumo`: SUMO's own models. Else the folder of a policy, a driver document, or
    the name of an installed driver, of a shipped one, or of a shipped policy (`paper_merge/naive-seed11`)."""
    persona: DocumentPath = "careful"
    """The persona of the ego: its payoff and decisions. The ego is a machine and has none of the human limits."""
    shield: Literal["rss"] | None = None
    """A safety layer. Each arm of an ego up to round 2 is played a second time with it: the ego's decision is kept
    unless responsibility-sensitive safety demands more braking. Nothing is trained with it. Left out: none."""
    perception: PathOrTable | None = None
    """Perception errors: a document, relative to this file, the name of a shipped one, or a table with the same keys.
    The ego drives with them in every game, also where it or another player is trained. Each arm of an ego up to round 2
    is played a second time without them. Left out: the ego sees what is there."""

    @property
    def perception_errors(self) -> PerceptionErrors | None:
        """The errors as the game uses them, of a campaign whose documents are read."""
        if self.perception is None:
            return None
        assert isinstance(self.perception, EgoPerception), "preflight reads the document"
        return self.perception.errors


class Population(Document):
    """A mixture of personas. Each game has a non-ego of one of them."""

    name: Name
    """The name of the population in stages, arms and tables."""
    shares: dict[Name, Annotated[float, Field(gt=0.0, le=1000.0)]] = Field(min_length=2, max_length=50)
    """Share of the games of each persona, by name. Shares are relative: 1 and 3 are a quarter and three quarters."""


class Crowd(Document):
    """The people of a scene with several, each with a persona of its own."""

    name: Name
    """The name of the crowd in stages, arms and tables."""
    personas: list[Name] = Field(min_length=2, max_length=MOST_PEOPLE)
    """The name of a persona for each person of the scene, in the order of its `[[non_ego]]`. Names may repeat."""


class Rounds(Document):
    """Iterated best response: non-ego and ego are trained against each other in turn. After each training from round 3
    on, the player goes on with the best of its new policy and all its earlier ones, by as many games as an arm has,
    none of which is a game of the assessment."""

    count: int = Field(2, ge=1, le=20)
    """Number of the last round. The non-ego learns in odd rounds, the ego in even rounds. The paper has 2 rounds. 1: no
    ego is retrained against a persona alone, only one against several (`retraining.against`)."""
    personas: list[Name] = Field([], max_length=50)
    """Names of the personas with rounds after round 2. Left out: all personas."""
    against: Literal["latest", "all", "equilibrium"] = "latest"
    """Opponent of a player from round 3 on. `latest`: the latest strategy of the other player. `all`: all its
    strategies so far in equal shares (fictitious play). `equilibrium`: the mixture of them in the equilibrium
    (policy-space response oracles)."""
    stop_early: bool | None = None
    """Whether the rounds of a persona end early, when an approximate equilibrium is reached: neither player has a
    best-response gap that is distinguishable from 0, and no search ends below its player's own strategy. Left out: yes
    if there is a table [best_response]."""


class BestResponseSearch(Document):
    """Best-response gap of each player of an arm, the gain from a change of its own strategy alone (equation 2): of the
    last arm of each persona's rounds (with `rounds.count = 1` the robust ego's, if any) and of the arms named here."""

    steps: int = Field(500_000, ge=1_000, le=1_000_000_000)
    """Budget of each training of a best response."""
    starts: int = Field(2, ge=1, le=20)
    """Trainings of each best response. The first starts from the player's own policy, the others from random
    parameters. The best one is selected by as many games as an arm has, none of which is a game of the assessment."""
    arms: list[Annotated[str, Field(min_length=1, max_length=200)]] = Field([], max_length=200)
    """Names of further arms to measure."""


class CrossPlay(Document):
    """Games of every ego of the campaign against every non-ego."""

    egos: list[DocumentPath] = Field([], max_length=50)
    """Further egos, as in `[ego] driver`: `sumo`, a driver document, or the folder or name of a policy."""


class Assessment(Document):
    """Assessment of the players."""

    episodes: int = Field(100, ge=2, le=1_000_000)
    """Games of each arm. Game k has the same start in every arm."""
    significance: float = Field(0.01, gt=0.0, lt=1.0)
    """A difference is called real if its p-value, after Holm's correction, is below this."""
    reference_drivers: bool = True
    """Whether each failure of an ego against a persona is judged: would a reference driver have prevented it?"""


class Attribution(Document):
    """Attribution of failures: which trait of a persona makes the naive ego fail, and how often. The games of
    `naive_vs_<persona>` are played again with one trait exchanged, for each trait in which the persona differs from the
    baseline: by the persona without the trait, and by the baseline with this trait alone."""

    baseline: DocumentPath
    """A careful person: its file, relative to this file, or the name of a shipped persona. It drives in the non-ego's
    place with the human limits of its document, and is trained as a persona of round 1, once for each seed. It may be a
    persona of the campaign."""


class Competence(Document):
    """What a player has to achieve without people before its results count. A question about players of which one
    achieves less is not answered, and a training that made such a player is reported as `did not learn`."""

    ego_goal_share: float = Field(0.97, ge=0.0, le=1.0)
    """Least share of its games alone in which an ego reaches its goal. A learned naive ego has to reach it as often
    beside SUMO's driver, unless it learned without it (`naive_training.alone_share = 1`). 0: not asked of egos."""
    non_ego_goal_share: float = Field(0.8, ge=0.0, le=1.0)
    """Least share of its games alone in which a non-ego reaches its goal. 0: not asked of non-egos."""
    non_ego_like_people: bool = True
    """Whether a question is answered only if its person is not outside the range of people, in any figure of
    `realism.csv` that its persona does not declare in `[[unlike_people]]`."""


class Acceptance(Document):
    """Bounds that the ego must keep for the campaign to pass. Each is judged for every persona and training seed, by
    the unfavourable end of its 95 % interval, so that few games don't pass where many would fail. A bound that is left
    out is not judged; one that can't be measured is not kept. `harness campaign` and `harness report` end with exit
    code 3 if a bound is not kept."""

    ego: Literal["last", "robust", "naive"] = "last"
    """The ego that is judged. `last`: that of the last round against each persona; the naive ego, if no round changes
    it. `robust`: the ego retrained against several personas. `naive`: the ego before round 2."""
    failure_rate: Share | None = None
    """Largest failure rate against a persona, in any arm of this ego against this persona."""
    failure_rate_alone: Share | None = None
    """Largest failure rate without the non-ego: what the ego could do before, it must not forget."""
    preventable_failure_rate: Share | None = None
    """Largest rate of failures against a persona that the careful and competent driver of UN R157 prevents when it
    drives the game from its start. Measured with assessment.reference_drivers."""
    near_miss_rate: Share | None = None
    """Largest share of games with a near miss against a persona: no contact, but too close by time to collision,
    post-encroachment time or time headway, as the columns `near_miss_...` of episodes.csv say."""
    harm_to_others_rate: Share | None = None
    """Largest share of games against a persona in which others fail without the ego: a person touches the edge of the
    drivable area, or a person or a vehicle of the background traffic touches another road user. An ego that saves
    itself must not leave the crash to others."""
    speed_loss_mps: Annotated[float, Field(ge=0.0, le=100.0)] | None = None
    """Largest loss of average speed against a persona, compared with the naive ego in the same games."""
    gap_share: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    """Largest best-response gap of the ego, as a share of its payoff. Measured with [best_response]. Not measured where
    the search ends below the ego's own strategy."""

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that are given, by their keys."""
        return self.model_dump(exclude={"ego"}, exclude_none=True)

    @model_validator(mode="after")
    def _bounds_something(self) -> Acceptance:
        if not self.bounds:
            raise ValueError("no bound is given: add one, such as failure_rate = 0.1, or leave out the table")
        return self


class Campaign(Document):
    """A campaign: one document, run by one command into one run folder."""

    name: CampaignName
    """The name of the campaign. The default run folder is reports/<name>."""
    scene: DocumentPath
    """Folder of the scene, relative to this file, or the name of a shipped scene."""
    roads: list[DocumentPath] = Field([], max_length=50)
    """Scenes with the same players on other roads, as `harness scene vary` writes them. An ego that learns plays an
    equal part of its games on each of them and on the road of `scene`. People learn on the road of `scene`, and all
    players are assessed there. Folders, relative to this file, or names of shipped scenes."""
    personas: list[DocumentPath] = Field(max_length=50)
    """Files of the personas that the ego meets, one after the other, relative to this file, or names of shipped
    personas. With none, `[]`, the ego drives alone and among SUMO's drivers."""
    seeds: list[Seed] = Field([1], min_length=1, max_length=100)
    """Training seeds. All players are trained once per seed. All trainings are assessed in the same games: their starts
    are drawn from the first seed."""
    policies: DocumentPath | None = None
    """Folder of trained policies, with the layout of `policies/` in a run folder. Nothing is trained; every learned
    player is read from this folder."""
    ego: Ego = Ego()
    training: Training = Training()
    naive_training: NaiveTraining = NaiveTraining()
    non_ego_training: NonEgoTraining = NonEgoTraining()
    retraining: Retraining = Retraining()
    reconfiguration: Reconfiguration = Reconfiguration()
    population: list[Population] = Field([], max_length=50)
    """Mixtures of personas. The ego meets a population like a persona, and is retrained against it."""
    crowd: list[Crowd] = Field([], max_length=50)
    """Mixed people of a scene with several. The ego meets a crowd like a persona, and is retrained against it."""
    rounds: Rounds = Rounds()
    best_response: BestResponseSearch | None = None
    crossplay: CrossPlay | None = None
    attribution: Attribution | None = None
    competence: Competence = Competence()
    assessment: Assessment = Assessment()
    acceptance: Acceptance | None = None

    @field_validator("seeds")
    @classmethod
    def _distinct(cls, seeds: list[int]) -> list[int]:
        if len(set(seeds)) < len(seeds):
            raise ValueError("a seed occurs twice")
        return seeds

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> Campaign:
        if self.policies is not None and (unused := self._unused_tables()):
            message = "with `policies` nothing is trained: this table would be ignored"
            raise Mistakes([(name, message, "leave out this table or `policies`") for name in unused])
        bounds = self.acceptance.bounds if self.acceptance is not None else {}
        leave_out = "leave out this key, or set ego.driver to 'learned'"
        mistakes = []
        if self.best_response is None:
            add = "add [best_response] or leave out this key"
            if self.rounds.stop_early:
                mistakes.append(("rounds.stop_early", "without [best_response], no equilibrium can be found", add))
            if "gap_share" in bounds:
                mistakes.append(("acceptance.gap_share", "without [best_response], no gap is measured", add))
        if "preventable_failure_rate" in bounds and not self.assessment.reference_drivers:
            message = "with assessment.reference_drivers = false, it is not judged which failures are preventable"
            mistakes.append(("acceptance.preventable_failure_rate", message, "leave out one of these keys"))
        if self.ego.driver == SUMO and self.ego.shield is not None:
            message = "SUMO drives this ego, so that there is no decision to check"
            mistakes.append(("ego.shield", message, "leave out this key, or name another ego.driver"))
        mistakes += [*self._perceived_by_sumo(), *self._without_replays()]
        if self.ego.driver != LEARNED:
            if self.rounds.count > Rounds().count:
                message = "the ego does not learn, so there are no further rounds"
                mistakes.append(("rounds.count", message, leave_out))
            if self.retraining.against:
                message = "an ego that does not learn can't be retrained"
                mistakes.append(("retraining.against", message, leave_out))
        if mistakes:
            raise Mistakes(mistakes)
        return self

    def _perceived_by_sumo(self) -> list[tuple[str, str, str]]:
        """Mistakes where perception errors are those of a driver of SUMO."""
        if self.ego.perception is None:
            return []
        if self.ego.driver == SUMO:
            message = "SUMO drives this ego, and its driver models know what is there"
            return [("ego.perception", message, "leave out this key, or name another ego.driver")]
        if self.crossplay is not None and SUMO in self.crossplay.egos:
            message = "SUMO's driver knows what is there: it can't be compared with egos with perception errors"
            return [("crossplay.egos", message, f"leave out {SUMO!r}, or ego.perception")]
        return []

    def _without_replays(self) -> list[tuple[str, str, str]]:
        """Mistakes where no start is replayed by regret, though the document asks for it."""
        key, leave_out = "retraining.starts", "leave out this key"
        if self.retraining.starts == Retraining().starts:
            return []
        if self.ego.driver != LEARNED:
            message = "an ego that does not learn can't be retrained"
            return [(key, message, f"{leave_out}, or set ego.driver to 'learned'")]
        if not self.personas:
            return [(key, "without personas, no ego is retrained", f"{leave_out}, or name a persona")]
        if self.retraining.alone_share == 1.0:
            message = "with retraining.alone_share = 1, no game is played against the non-ego"
            return [(key, message, f"{leave_out}, or lower retraining.alone_share")]
        return []

    def _unused_tables(self) -> list[str]:
        """The training tables of the document that nothing uses in a campaign with `policies`."""
        given = [name for name in TRAINING_TABLES if name in self.model_fields_set]
        if self.non_ego_training.model_fields_set <= {"together"} and "non_ego_training" in given:
            given.remove("non_ego_training")  # it says which policies are read
        if self.retraining.model_fields_set <= {"against"} and "retraining" in given:
            given.remove("retraining")  # `against` names the arms of the robust ego, which exist without training too
        if self.best_response is None:
            return given
        return [name for name in given if name in ("naive_training", "retraining")]  # best responses are trained

    @property
    def mixed_people(self) -> dict[str, tuple[dict[str, float], ...]]:
        """Populations and crowds by name: the shares of personas in the places of the non-egos, in their order and from
        the first again."""
        populations = {each.name: (each.shares,) for each in self.population}
        return populations | {each.name: tuple({name: 1.0} for name in each.personas) for each in self.crowd}

    @property
    def start_seed(self) -> int:
        """The seed of the assessment's starts, the same for all trainings: a seed that is added at the end of `seeds`
        changes no game of the others."""
        return self.seeds[0]

    @property
    def stops_early(self) -> bool:
        """Whether rounds may end before the last one."""
        return self.best_response is not None and self.rounds.stop_early is not False

    def recorded(self) -> dict[str, Any]:
        """The document as the manifest records it: every key with its value. Keys about training and tuning are left
        out where they have no effect."""
        unused: dict[str, Any] = {"reconfiguration": True} if self.ego.driver in (LEARNED, SUMO) else {}
        if self.policies is None:
            return self.model_dump(mode="json", exclude=unused)
        unused["naive_training"] = True
        unused["retraining"] = {*Retraining.model_fields} - {"against"} if self.retraining.against else True
        if self.best_response is None:
            together = self.non_ego_training.together
            unused |= {"training": True}
            unused["non_ego_training"] = {*NonEgoTraining.model_fields} - {"together"} if together else True
        return self.model_dump(mode="json", exclude=unused)


def resolve(campaign_file: Path, path: str) -> Path:
    """The absolute path of a path in a campaign, which is relative to the campaign's file."""
    return Path(os.path.realpath(campaign_file.parent / path))
