"""The report of a run as one HTML file: opens offline, loads nothing, and shows the numbers of the CSV files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.unplayed_games import reasons_of, were_played
from harness.reports import human_ranges
from harness.reports.acceptance_wording import acceptance_lines, by_sentence, headline
from harness.reports.arm_figures import MOST_DOTS
from harness.reports.arm_glossary import glossary
from harness.reports.attribution_section import attribution_section
from harness.reports.cards import card
from harness.reports.data_table import table
from harness.reports.embedding import GameTracks, embedded_games, recorded_document
from harness.reports.failing_paths import FailingPath, worst_figures
from harness.reports.failure_table import failure_table
from harness.reports.first_answers import first_answers
from harness.reports.game import game_section, selection_sentences
from harness.reports.game_links import GameLinks
from harness.reports.learning import learning, searches, stopped
from harness.reports.manoeuvres import causes_by_game, failures_by_cause, marks_of
from harness.reports.next_steps import next_steps
from harness.reports.page_template import CONTENT_POLICY, ELSEWHERE, LIBRARIES, SCRIPTS, page_of, sources
from harness.reports.provenance import QUICK, asked_alone, command_of, facts, made_by, mixed_versions
from harness.reports.run_tables import RunTables
from harness.reports.start_section import start_section
from harness.reports.verdict_wording import as_sentence, planned_in_words

MOST_BROKEN = 3
"""Broken bounds that the first screen shows; the others are folded, so that the answers stay in sight."""
MOST_ROWS = 10_000
"""The page leaves out a longer table of games and refers to its CSV file."""
GAMES_BYTES = 600_000
"""Room for recorded games. `harness serve` shows all."""
CAPTIONS = {
    "comparisons": "Every test of a trained pair.",
    "over_trainings": "Every test over trainings.",
    "summary": "A row per arm and training seed.",
    "training": "A row per window of a learning curve.",
    "episodes": "A row per game.",
    "reconfiguration": "A row per trial and parameter of a search.",
    "shields": "A row per arm and training seed: the ego without its shield, and with it, in the same games.",
    "perception": "A row per arm and training seed: the ego with perception errors, and without, in the same games.",
    "selections": "A row per candidate of each selection; the last one is the new answer.",
}
"""Of the tables that are shown as the CSV files have them."""
REPLAYS_SHOWN = 12
"""`harness replay RUN --list` lists all."""


def render_page(
    tables: RunTables,
    games: Iterable[GameTracks] = (),
    scene: Mapping[str, Any] | None = None,
    paths: Sequence[FailingPath] = (),
) -> str:
    """The report as HTML. Equal input gives equal text.

    `games`, those to watch first at the front, are embedded as far as they fit (`GAMES_BYTES`); `paths` are drawn over
    one another. Without a `scene`, the road as `road.js` reads it, there are neither.
    """
    causes = causes_by_game(tables.causes)
    texts = embedded_games(
        games if scene is not None else (),
        marks_of(tables.manoeuvres),
        causes,
        tables.crowds,
        GAMES_BYTES,
    )
    links = GameLinks(embedded=texts, episodes=tables.episodes)
    arms, pairs = failures_by_cause(tables.of_own_traits(tables.causes), texts)
    steps = next_steps(tables)
    return page_of(
        "report",
        **_header(tables),
        **_troubles(tables),
        acceptance=_acceptance(tables),
        most_broken=MOST_BROKEN,
        failure_table=failure_table(tables, links),
        answers=first_answers(tables, steps),
        worst=list(worst_figures(paths, scene, causes, tables.several_seeds)) if scene is not None else [],
        attribution=attribution_section(tables, links),
        starts=start_section(tables, links),
        next_steps=steps,
        cards=[card(persona, place, tables, links, scene, paths) for place, persona in enumerate(tables.personas, 1)],
        most_dots=MOST_DOTS if tables.episodes.groupby("arm").size().max() > MOST_DOTS else 0,
        planned=planned_in_words(tables),
        embedded=texts,
        left=len(tables.played) - len(texts),
        recorded=recorded_document(scene, texts.values()),
        pairs=pairs,
        pair_arms=arms,
        curves=learning(tables),
        searches=searches(tables.reconfiguration),
        **_tables(tables),
        replays=links.replays(tables.replays, REPLAYS_SHOWN),
        unlisted=max(len(tables.replays) - REPLAYS_SHOWN, 0),
        significance=tables.significance,
        asked_alone=asked_alone(tables.manifest),
        rules=sorted({as_sentence(stage["rule"]) for stage in tables.stages.values() if stage.get("rule")}),
        glossary=glossary(tables),
        versions=tables.manifest.get("versions", {}),
        game=game_section(tables.game, links),
        selections=selection_sentences(tables.selections),
        human_rows=human_ranges.human_rows(tables.realism),
        human_headline=human_ranges.headline(tables.realism),
        human_plots=human_ranges.plots(tables.realism),
        content_policy=CONTENT_POLICY,
        elsewhere=ELSEWHERE.format("[]"),
        libraries=sources(LIBRARIES),
        script=sources(SCRIPTS),
    )


def _header(tables: RunTables) -> dict[str, Any]:
    manifest = tables.manifest
    return {
        "command": command_of(manifest),
        "made_by": made_by(manifest),
        "name": manifest.get("name", "campaign"),
        "facts": facts(manifest, tables.seeds, len(tables.personas)),
        "quick": QUICK if manifest.get("quick") else "",
        "trained_before": tables.campaign.get("policies") or "",
        "several_seeds": tables.several_seeds,
        "change": tables.change,
    }


def _troubles(tables: RunTables) -> dict[str, Any]:
    """The banners: what is unfinished, what could not be played, and what makes the numbers mean less."""
    errored = tables.episodes[~were_played(tables.episodes)]
    return {
        "from_tables": tables.is_from_tables,
        "unfinished": tables.unfinished,
        "not_learned": [
            (name, stopped(each)) for name, each in tables.stages.items() if each.get("stopped") == DID_NOT_LEARN
        ],
        "mixed": mixed_versions(tables.stages),
        "errored": errored.groupby(["arm", "seed"], sort=False).size().items(),
        "errors": len(errored),
        "varying": list(tables.manifest.get("varying_drivers", {}).items()),
        "learned_elsewhere": list(tables.manifest.get("learned_elsewhere", {}).items()),
        "error_reasons": reasons_of(errored["error"]),
        "ego_games": int(tables.episodes["ego_failed"].notna().sum()),
    }


def _acceptance(tables: RunTables) -> tuple[bool, str, list[Any]] | None:
    """Whether every bound is kept, that in words, and a line for each, those that were measured first; None without
    bounds."""
    if tables.acceptance is None:
        return None
    lines = acceptance_lines(tables.acceptance, len(tables.seeds))
    shown = sorted(by_sentence(lines), key=lambda each: not each.measured)
    return all(each.passed for each in lines), headline(tables.acceptance), shown


def _tables(tables: RunTables) -> dict[str, Any]:
    frames = {name: getattr(tables, name) for name in CAPTIONS}
    if len(tables.episodes) > MOST_ROWS:
        frames["episodes"] = tables.episodes[:0]
    return {
        "tables": {name: table(name, CAPTIONS[name], frame) for name, frame in frames.items()},
        "games": len(tables.episodes),
        "most_rows": MOST_ROWS,
        "stages": tables.stages,
        "stopped": stopped,
    }
