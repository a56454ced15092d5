"""The report of a run as one HTML file: opens offline, loads nothing, and shows the numbers of the CSV files."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import pandas as pd

from harness.evaluation.comparisons.acceptance_checks import worst_of_each
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import NAIVE_ALONE
from harness.evaluation.unplayed_games import reasons_of
from harness.reports.acceptance_wording import headline, line
from harness.reports.arm_glossary import glossary
from harness.reports.cards import CAUTION, Card, arm_labels, card
from harness.reports.data_table import table
from harness.reports.differences import effect
from harness.reports.distributions import MOST_DOTS
from harness.reports.embedding import Embedded
from harness.reports.game import game_section
from harness.reports.game_links import GameLinks, replay_list, worst_game
from harness.reports.learning import learning, searches, stopped
from harness.reports.manoeuvres import MOST_LISTED, failures_by_cause, marks_of
from harness.reports.next_steps import first_answers, next_steps
from harness.reports.page_template import CONTENT_POLICY, ELSEWHERE, environment_of, libraries, script
from harness.reports.player_data import GameTracks, SceneDrawing, key
from harness.reports.provenance import asked_alone, command_of, facts, made_by, mixed_versions
from harness.reports.run_findings import RunFindings, results, unplayed
from harness.reports.run_tables import RunTables

MOST_ROWS = 10_000
"""The page leaves out a longer table of games and refers to its CSV file."""
GAMES_BYTES = 600_000
"""Room for recorded games. `harness serve` shows all."""
QUICK = "Quick run: fewer training steps than table 1; not for conclusions."
CAPTIONS = {
    "comparisons": "Every test of the campaign.",
    "summary": "A row per arm and training seed.",
    "training": "A row per window of a learning curve.",
    "episodes": "A row per game.",
    "reconfiguration": "A row per trial and parameter of a search.",
}
"""Of the tables that are shown as the CSV files have them."""
METRICS = {"failure": "failures", "mean_speed": "average speed"}
REPLAYS_SHOWN = 12
"""`harness replay RUN --list` lists all."""


def render_page(tables: RunTables, games: Iterable[GameTracks] = (), scene: SceneDrawing | None = None) -> str:
    """The report as HTML. Equal input gives equal text.

    `games`, those to watch first at the front, are embedded as far as they fit (`GAMES_BYTES`); without a `scene` none
    is. Raises ValueError when a frame of `tables` does not have a table's columns.
    """
    tables = tables.with_types()
    found = results(tables)
    listed = tables.episodes if len(tables.episodes) <= MOST_ROWS else tables.episodes[:0]
    embedded = Embedded(scene, games, marks_of(tables.manoeuvres), GAMES_BYTES, crowds=found.crowds)
    links = GameLinks(embedded=embedded.keys, episodes=tables.episodes)
    environment = environment_of("reports")
    page = environment.get_template("report.html.jinja").render(
        **_header(tables, found),
        **_troubles(tables),
        **_acceptance(tables, found),
        **_cards(tables, found, links),
        **_player(tables, embedded),
        **_manoeuvres(tables),
        **_learning(tables),
        **_tables(tables, listed),
        **_replays(tables, embedded.keys),
        **_method(tables, found),
        game=game_section(tables.game, links),
        content_policy=CONTENT_POLICY,
        elsewhere=ELSEWHERE.format("[]"),
        libraries=libraries(environment),
        script=script(environment),
    )
    return page.strip() + "\n"


def _header(tables: RunTables, found: RunFindings) -> dict[str, Any]:
    manifest = tables.manifest
    return {
        "command": command_of(manifest),
        "made_by": made_by(manifest),
        "name": manifest.get("name", "campaign"),
        "facts": facts(manifest, found.seeds, len(tables.personas)),
        "quick": QUICK if manifest.get("quick") else "",
        "trained_before": manifest.get("campaign", {}).get("policies") or "",
        "several_seeds": len(found.seeds) > 1,
        "change": found.change,
    }


def _troubles(tables: RunTables) -> dict[str, Any]:
    """The banners: unfinished stages, mixed versions, games that could not be played."""
    errored = tables.episodes[unplayed(tables.episodes)]
    return {
        "unfinished": tables.unfinished,
        "not_learned": [
            (name, stopped(each)) for name, each in tables.stages.items() if each.get("stopped") == DID_NOT_LEARN
        ],
        "mixed": mixed_versions(tables.stages),
        "errored": errored.groupby(["arm", "seed"], sort=False).size().items(),
        "errors": len(errored),
        "varying": list(tables.manifest.get("varying_drivers", {}).items()),
        "error_reasons": reasons_of(errored["error"]),
        "ego_games": int(tables.episodes["ego_failed"].notna().sum()),
    }


def _acceptance(tables: RunTables, found: RunFindings) -> dict[str, Any]:
    """The verdict on the bounds of the campaign, and what to do next."""
    checks = tables.acceptance
    lines = [line(check, len(found.seeds)) for check in worst_of_each(checks or ())]
    steps = next_steps(tables, found)
    return {
        "acceptance": None if checks is None else (all(each.passed for each in lines), headline(checks), lines),
        "answers": first_answers(tables.personas, found, steps),
        "next_steps": steps,
    }


def _cards(tables: RunTables, found: RunFindings, links: GameLinks) -> dict[str, Any]:
    """The verdicts, and the figures and tests below them."""
    games_of_arm = tables.episodes.groupby("arm").size().max()
    return {
        "cards": [_card(persona, place, found, links) for place, persona in enumerate(tables.personas, 1)],
        "most_dots": MOST_DOTS if games_of_arm > MOST_DOTS else 0,
        "caution": CAUTION,
        "metrics": METRICS,
        "effect": effect,
        "tests": int(tables.comparisons["p_value"].notna().sum()),
    }


def _card(persona: str, place: int, found: RunFindings, links: GameLinks) -> Card:
    change = found.change if found.asked("RQ2", persona) else None
    labels = arm_labels(persona, change, found.naive)
    against = {arm: label for label, _, arm in labels if arm != NAIVE_ALONE.name}
    return card(persona, place, found, worst=worst_game(against, links.episodes, links.embedded), links=links)


def _player(tables: RunTables, embedded: Embedded) -> dict[str, Any]:
    played = len(tables.episodes) - int(unplayed(tables.episodes).sum())
    return {
        "embedded": embedded.keys,
        "left": played - len(embedded.keys),
        "key": key,
        "recorded": embedded.document(),
    }


def _manoeuvres(tables: RunTables) -> dict[str, Any]:
    if tables.manoeuvres is None:
        return {"pairs": None, "pair_arms": [], "most_listed": MOST_LISTED}
    arms, pairs = failures_by_cause(tables.causes)
    return {"pairs": pairs, "pair_arms": arms, "most_listed": MOST_LISTED}


def _learning(tables: RunTables) -> dict[str, Any]:
    """The learning curves, and the searches of egos that can't be trained."""
    return {
        "learning": learning(tables),
        "searches": searches(tables.reconfiguration),
    }


def _tables(tables: RunTables, listed: pd.DataFrame) -> dict[str, Any]:
    """The tables as cells; `listed` are the games that the page lists."""
    frames = {
        "comparisons": tables.comparisons,
        "summary": tables.summary,
        "training": tables.training,
        "episodes": listed,
    }
    if len(tables.reconfiguration):
        frames["reconfiguration"] = tables.reconfiguration
    return {
        "tables": {name: table(name, CAPTIONS[name], frame) for name, frame in frames.items()},
        "games": len(tables.episodes),
        "most_rows": MOST_ROWS,
        "stages": tables.stages,
        "stopped": stopped,
    }


def _replays(tables: RunTables, embedded: Container[str]) -> dict[str, Any]:
    return {
        "replays": replay_list(tables.replays, tables.episodes, embedded)[:REPLAYS_SHOWN],
        "unlisted": max(len(tables.replays) - REPLAYS_SHOWN, 0),
    }


def _method(tables: RunTables, found: RunFindings) -> dict[str, Any]:
    return {
        "significance": found.significance,
        "asked_alone": asked_alone(tables.manifest),
        "rules": sorted({stage["rule"] for stage in tables.stages.values() if stage.get("rule")}),
        "glossary": glossary(list(dict.fromkeys(tables.summary["arm"])), tables.arms, found),
        "versions": tables.manifest.get("versions", {}),
    }
