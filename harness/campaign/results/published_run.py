"""The page of a published run: the one that is published with it, or one from its tables, without games."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from harness.campaign.plan.stages import arms_of, strategies_of
from harness.campaign.results.drawn_starts import drawn_starts, people_drive
from harness.campaign.results.evaluate_run import with_acceptance
from harness.campaign.results.matchups import matchups_of
from harness.campaign.results.served_report import PAGE
from harness.campaign.storage.manifest import campaign_in, digests_read, done_in, is_tuned, planned
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.evaluation.columns import TABLES
from harness.evaluation.game_theory.findings import GameFindings, cautions
from harness.evaluation.tables import read_csv, table_of
from harness.files import has_digest
from harness.reports.page import render_page
from harness.reports.run_tables import RunTables
from harness.road.scene.open_scene import open_scene
from harness.shipped_documents import shipped

_ALWAYS = ("episodes", "summary", "comparisons", "training")
_OF_GAME = ("gaps", "crossplay", "equilibria", "generalisation")


class PublishedReport:
    """What the server of a published run sends: its page."""

    def __init__(self, folder: RunFolder) -> None:
        """Raises UsageError as `published_tables` does. A page from tables takes some time, and is kept in memory."""
        report = folder.path / "report.html"
        if report.is_file():
            folder.check_link(report)
            self._page = report.read_bytes()
        else:
            self._page = render_page(published_tables(folder)).encode()

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Content type and content of a path; None if there is nothing."""
        return (PAGE, self._page) if path in ("/", "/report.html") else None


def published_tables(folder: RunFolder) -> RunTables:
    """The tables of a published run, as far as they are published. Raises UsageError for a damaged one."""
    manifest = folder.manifest()
    stages, campaign = planned(manifest), campaign_in(manifest)
    known = [name for name in TABLES if name in RunTables.__dataclass_fields__]
    names = [name for name in known if name in _ALWAYS or _is_there(folder.path, name)]
    frames: dict[str, Any] = {name: read_csv(folder.path / f"{name}.csv") for name in names}
    tables = RunTables(
        manifest=manifest,
        arms=arms_of(stages),
        strategies=strategies_of(stages),
        is_from_tables=True,
        **frames,
    )
    tables = _with_scene(tables, campaign)
    tables = replace(tables, game=_game(folder, campaign, tables))
    return with_acceptance(tables, campaign, is_judged="preventability" in frames)


def _is_there(folder: Path, name: str) -> bool:
    return any((folder / f"{name}.csv{suffix}").is_file() for suffix in ("", ".gz"))


def _with_scene(tables: RunTables, campaign: Campaign) -> RunTables:
    """The tables with what the scene tells. The run's own copy is not published, but the scene may be a shipped one. It
    tells the starts only if it is as it was then."""
    folder = shipped("networks") / Path(campaign.scene).name
    if not folder.is_dir():
        return tables
    scene = open_scene(folder)
    tables = replace(tables, non_ego_drives=people_drive(scene))
    digests = digests_read(tables.manifest).get(folder.name, {})
    if not (digests and all(has_digest(folder / name, [digest]) for name, digest in digests.items())):
        return tables
    return replace(tables, starts=drawn_starts(scene, campaign.start_seed, tables.episodes["episode"]))


def _game(folder: RunFolder, campaign: Campaign, tables: RunTables) -> GameFindings | None:
    manifest = tables.manifest
    game = matchups_of(campaign, manifest["personas"], done_in(manifest), is_tuned(manifest))
    if game is None:
        return None
    found = {
        name: read_csv(folder.path / f"{name}.csv") if _is_there(folder.path, name) else table_of(name)
        for name in _OF_GAME
    }
    return GameFindings(**found, cautions=cautions(game.pairings, tables.episodes))
