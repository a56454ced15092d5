"""The games of a league in its table: which of them the ego failed, and which are the same games for another ego."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import pandas as pd

from harness.campaign.plan.planned_drivers import PlannedMember, Trained, TrainedBefore, members_of
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.checksums import checksums_of, digest_of
from harness.campaign.storage.manifest import campaign_in, digests_read
from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.policy_file import policy_files
from harness.evaluation.comparisons.tied_ranks import GAME, PLAYER

LEAGUE_GAMES = "league_games.csv"


def outcome_cells(games: pd.DataFrame) -> dict[str, str]:
    """The cells `failed_episodes` and `unplayed_episodes` of the games of an arm, rows of `episodes`."""
    played = (games["error"] == "") & games["ego_failed"].notna()
    failed = played & (games["ego_failed"] == 1)
    return {"failed_episodes": _joined(games[failed]), "unplayed_episodes": _joined(games[~played])}


def games_in(table: pd.DataFrame) -> pd.DataFrame:
    """The games of a table `league_games` that were played, as `league_ranks` reads them."""
    columns = [*GAME, *PLAYER, "ego_failed"]
    return pd.DataFrame([game for row in table.to_dict("records") for game in _games_of(row)], columns=columns)


def games_sha256(
    run: RunFolder, manifest: Mapping[str, Any], stages: Iterable[AssessmentStage]
) -> dict[tuple[str, int], str]:
    """The digest of what the games of each arm depend on beside the ego, by its name and training seed: the same for
    each training seed of the people where no person is trained."""
    scene, start_seed = checksums_of(run.scene, sorted(run.scene.iterdir())), campaign_in(manifest).start_seed
    read = digests_read(manifest)

    def policy(driver: PlannedMember) -> Mapping[str, Any]:
        match driver:
            case Trained(stage=name):  # a policy of several personas, from which this run derived the person's
                return checksums_of(run.policy(name), policy_files(run.policy(name)))
            case TrainedBefore(stage=name):
                return read.get(name, {})
            case _:
                return {}

    return {
        (stage.name, stage.seed): digest_of(
            {
                "scene": scene,
                "start_seed": start_seed,
                "persona": manifest["persona_documents"].get(stage.persona),
                "policies": [policy(each) for each in members_of(*stage.non_ego)],
            }
        )
        for stage in stages
    }


def _games_of(row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    failed, unplayed = (set(map(int, row[f"{each}_episodes"].split())) for each in ("failed", "unplayed"))
    of_row = {"games_sha256": row["games_sha256"], **{name: row[name] for name in PLAYER}}
    for episode in range(row["episodes"]):
        if episode not in unplayed:
            yield {**of_row, "episode": episode, "ego_failed": int(episode in failed)}


def _joined(games: pd.DataFrame) -> str:
    return " ".join(map(str, sorted(games["episode"])))
