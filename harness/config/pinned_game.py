"""A pinned game: one game of a campaign that the ego failed, as a document that any ego can play again."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from harness.config.campaign import DocumentPath, Seed
from harness.config.ego_perception import EgoPerception
from harness.config.toml_reading import Document
from harness.game.roles import MOST_PEOPLE

FORMAT = 1

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Metres = Annotated[float, Field(ge=-1e6, le=1e6)]
Speed = Annotated[float, Field(ge=0.0, le=200.0)]
Line = Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]


class PinnedStart(Document):
    """Where and how fast the players start, ego first."""

    position_m: list[Metres] = Field(min_length=2, max_length=1 + MOST_PEOPLE)
    """Of the front bumpers, along the players' start lanes."""
    speed_mps: list[Speed] = Field(min_length=2, max_length=1 + MOST_PEOPLE)

    @model_validator(mode="after")
    def _one_each(self) -> PinnedStart:
        if len(self.position_m) != len(self.speed_mps):
            raise ValueError("position_m and speed_mps must have one value for each player")
        return self


class PinnedPerson(Document):
    """Who drives a non-ego."""

    policy: DocumentPath | None = None
    """The folder of its policy, relative to this document. Left out: SUMO's own models drive."""
    policy_sha256: Sha256 | None = None
    """Of the parameters of that policy: another policy would play another game."""
    persona: DocumentPath
    """Its persona, which gives its human limits."""

    @model_validator(mode="after")
    def _policy_is_known(self) -> PinnedPerson:
        if (self.policy is None) != (self.policy_sha256 is None):
            raise ValueError("policy and policy_sha256 belong together: give both or neither")
        return self


class PinnedGame(Document):
    """One game. Everything random in it, such as lapses of attention and background traffic, is drawn from `start_seed`
    and `episode`, as in the campaign."""

    format: Literal[1]
    """The format of this document."""
    scene: DocumentPath
    """The folder of the scene, relative to this document."""
    scene_sha256: dict[Line, Sha256] = Field(min_length=1, max_length=100)
    """Of each file of the scene."""
    arm: Line
    """The arm in which the game was found."""
    seed: Seed
    """The training seed of that arm."""
    start_seed: Seed | None = None
    """The seed of the starts in that campaign; left out: that of the arm."""
    episode: int = Field(ge=0, le=10**9)
    """The number of the game in that arm."""
    outcome: Literal["collision", "rail", "timeout"]
    """How the game ends for the ego with which it was found."""
    found_with: Line
    """That ego."""
    alike: int = Field(1, ge=1, le=10**9)
    """Failures of that arm that this game stands for."""
    ego_persona: DocumentPath
    """The persona of the ego's seat."""
    ego_perception: EgoPerception | None = None
    """The perception errors with which the ego drives; left out: it sees what is there."""
    people: list[PinnedPerson] = Field(min_length=1, max_length=MOST_PEOPLE)
    """The non-egos."""
    drawn_start: PinnedStart
    """The start of the game in the campaign."""
    start: PinnedStart
    """The mildest start found at which that ego still fails."""
    no_failure_from: PinnedStart | None = None
    """The nearest start found from which it no longer fails; left out where none was found."""

    @model_validator(mode="after")
    def _players_match(self) -> PinnedGame:
        starts = [each for each in (self.drawn_start, self.start, self.no_failure_from) if each is not None]
        if any(len(each.position_m) != 1 + len(self.people) for each in starts):
            raise ValueError("a start must have one value for the ego and one for each of the people")
        return self
