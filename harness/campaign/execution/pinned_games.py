"""Writing pinned games: failures of a run, each reduced to the mildest start that still fails, in a folder of its own.

<folder>/<arm>-seed<seed>-<episode>.toml    a pinned game
<folder>/scene/                             a copy of the scene
<folder>/policies/<stage>/                  a copy of each policy that drives a person
<folder>/personas/<name>.toml               the personas

So the folder can be moved, committed and played without the run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from harness.assessment.start_trials import StartTrials
from harness.campaign.execution.run_players import RunPlayers, SeatedDriver
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.results.read_run import episodes_of
from harness.campaign.storage.run_folder import RunFolder
from harness.config.persona import Persona
from harness.config.pinned_game import FORMAT, PinnedGame, PinnedPerson, PinnedStart
from harness.drivers.policy_file import policy_files
from harness.errors import UsageError
from harness.evaluation.minimising import minimise
from harness.evaluation.rule_book.causes import causes_in_words
from harness.evaluation.tables import read_csv
from harness.evaluation.worst_first import worst_first
from harness.files import make_folder, write_atomically
from harness.game.arrays import FloatArray
from harness.game.initial_state import draw_initial_state
from harness.game.seeding import parts_of

TOLERANCE_M, TOLERANCE_MPS = 0.05, 0.05
"""How close the two starts found are to each other in every position and speed."""
_MOST_STARTS = 12  # starts of other episodes that are tried until one does not fail


@dataclass(frozen=True, kw_only=True)
class RunFailure:
    arm: str
    seed: int
    episode: int
    alike: int = 1
    """Failures of its arm that it stands for."""


@dataclass(frozen=True, kw_only=True)
class Pinned:
    """A pinned game that was written, and what was found."""

    file: Path
    game: PinnedGame
    games: int
    """Games played to find it, the failure played again among them."""


class PinnedGames:
    """Pins failures of one run in a folder."""

    def __init__(self, folder: RunFolder, players: RunPlayers, out: Path) -> None:
        self._players, self._out, self._start_seed = players, out, players.document.start_seed
        self._episodes = episodes_of(folder)
        self._causes = causes_in_words(read_csv(folder.result("causes.csv")))

    def failures(self, arm: str | None = None) -> list[RunFailure]:
        """One failure for each kind of failure of each arm (of one arm, if named) and seed.

        Failures are of one kind if they have the same outcome and the same pair of manoeuvres led to it. The worst
        stands for them all.
        """
        known = {(each.name, each.seed) for each in self._players.arms()}
        failed = self._failed()
        named = [(game.arm, game.seed) in known and arm in (None, game.arm) for game in failed.itertuples()]
        failed = worst_first(failed.loc[failed.index[named]])
        causes = [self._causes.get((game.arm, game.seed, game.episode), "") for game in failed.itertuples()]
        kinds = failed.assign(cause=causes).groupby(["arm", "seed", "ego_outcome", "cause"], sort=False)["episode"]
        return [
            RunFailure(arm=str(name), seed=int(seed), episode=int(episodes.iloc[0]), alike=len(episodes))
            for (name, seed, _, _), episodes in kinds
        ]

    def failure(self, arm: str, seed: int, episode: int) -> RunFailure:
        """One failed game. Raises UsageError if the run has no such game, or if the ego does not fail in it."""
        self._players.arm(arm, seed)
        failed = self._failed()
        episodes = failed.loc[(failed["arm"] == arm) & (failed["seed"] == seed), "episode"].tolist()
        if episode not in episodes:
            some = ", ".join(str(each) for each in episodes[:10])
            remedy = f"it fails in {some}" if episodes else "the ego fails in no game of this arm"
            raise UsageError.of(self._out, f"{arm} {episode}", "the ego does not fail in this game", remedy)
        return RunFailure(arm=arm, seed=seed, episode=episode)

    def pin(self, failure: RunFailure) -> Pinned:
        """Minimise a failure and write it. Raises UsageError if the game can't be repeated, SimulationError."""
        stage, scene = self._players.arm(failure.arm, failure.seed), self._players.scene
        ego, people = self._players.ego(stage), self._players.people(stage, failure.episode)
        with StartTrials(self._players.seated(stage), failure.episode) as trials:
            game = trials.play(None)
            if not game.record.get("ego_failed"):
                message = "played again, the ego does not fail: the run was made by another version or machine"
                raise UsageError.of(self._out, f"{failure.arm} {failure.episode}", message, "run the campaign again")
            failing = drawn = trials.last_start

            def fails(start: FloatArray) -> bool:
                return bool(trials.play(start).record.get("ego_failed", 1))

            passing = next((each for each in self._passing(stage, failing) if not fails(each)), None)
            if passing is not None:
                failing, passing = minimise(fails, failing, passing, _tolerance(failing))
            last = trials.play(failing)
        starts = {"drawn_start": drawn, "start": failing, "no_failure_from": passing}
        pinned = PinnedGame.model_validate(
            {
                "format": FORMAT,
                "scene": "scene",
                "scene_sha256": {
                    name: self._write(f"scene/{name}", (scene.folder / name).read_bytes())
                    for name in scene.document.files
                },
                "arm": failure.arm,
                "seed": failure.seed,
                "start_seed": self._start_seed if self._start_seed != failure.seed else None,
                "episode": failure.episode,
                "outcome": str(last.record["ego_outcome"]),
                "found_with": ego.policy.name if ego.policy is not None else failure.arm.partition("_vs_")[0],
                "alike": failure.alike,
                "ego_persona": self._copied_persona(ego.persona),
                "ego_perception": self._players.document.ego.perception,
                "people": [self._person(each) for each in people],
                **{name: _start(each) for name, each in starts.items() if each is not None},
            }
        )
        name = f"{failure.arm}-seed{failure.seed}-{failure.episode:04d}.toml"
        self._write(name, pinned.toml(_COMMENT).encode())
        return Pinned(file=self._out / name, game=pinned, games=trials.played)

    def _failed(self) -> pd.DataFrame:
        return self._episodes[(self._episodes["error"] == "") & (self._episodes["ego_failed"] == 1)]

    def _passing(self, stage: AssessmentStage, failing: FloatArray) -> Iterator[FloatArray]:
        games = self._episodes
        of_arm = (games["arm"] == stage.name) & (games["seed"] == stage.seed)
        passed = games.loc[of_arm & (games["error"] == "") & (games["ego_failed"] == 0), "episode"]
        starts = [self._start_of(int(episode)) for episode in passed]
        starts.sort(key=lambda start: float(np.abs((start - failing) / _tolerance(failing)).max()))
        yield from starts[:_MOST_STARTS]

    def _start_of(self, episode: int) -> FloatArray:
        """[2 P] the start that is drawn for an episode."""
        drawn = draw_initial_state(self._players.scene.usual_starts, *parts_of(self._start_seed, episode))
        return np.concatenate((drawn.position_m, drawn.speed_mps))

    def _write(self, place: str, content: bytes) -> str:
        make_folder((self._out / place).parent)
        write_atomically(self._out / place, content)
        return hashlib.sha256(content).hexdigest()

    def _copied_persona(self, persona: Persona) -> str:
        place = f"personas/{persona.name}.toml"
        self._write(place, persona.toml().encode())
        return place

    def _person(self, seated: SeatedDriver) -> PinnedPerson:
        persona = self._copied_persona(seated.persona)
        if seated.policy is None:
            return PinnedPerson(persona=persona)
        policy = f"policies/{seated.policy.name}"
        card, parameters = policy_files(seated.policy)
        self._write(f"{policy}/{card.name}", card.read_bytes())
        digest = self._write(f"{policy}/{parameters.name}", parameters.read_bytes())
        return PinnedPerson(persona=persona, policy=policy, policy_sha256=digest)


_COMMENT = "A game that the ego failed, from the mildest start found. Play it: harness regression FOLDER --ego DRIVER"


def _tolerance(start: FloatArray) -> FloatArray:
    """[2 P] of positions and speeds."""
    return np.repeat([TOLERANCE_M, TOLERANCE_MPS], len(start) // 2)


def _start(start: FloatArray) -> PinnedStart:
    position_m, speed_mps = np.split(start, 2)
    return PinnedStart(position_m=position_m.tolist(), speed_mps=speed_mps.tolist())
