"""The report of a run as one HTML file: opens offline, loads nothing, and shows the numbers of the CSV files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from harness.reports.cards import card
from harness.reports.data_table import table
from harness.reports.distributions import MOST_DOTS
from harness.reports.embedding import Embedded
from harness.reports.figures import steps_text
from harness.reports.game import game_section
from harness.reports.player_data import RecordedGame, SceneDrawing, key
from harness.reports.learning import learning, stopped
from harness.reports.manoeuvres import MOST_LISTED, failures_by_pair, marks_of
from harness.reports.provenance import mixed_versions
from harness.reports.replays import failures, keys, replay_list, worst_game
from harness.reports.results import results, unplayed
from harness.reports.search import searches
from harness.evaluation.tables import RECONFIGURATION_COLUMNS
from harness.evaluation.tables import typed
from harness.evaluation.game_theory.records import GameFindings

MOST_ROWS = 3_000
"""A table longer than this is left to its CSV file, and the page says so."""
GAMES_BYTES = 8_000_000
PAGE_BYTES = 10_000_000
"""The page is not to be longer: recorded games get what the rest leaves of it, and never more than GAMES_BYTES."""
_ROW_BYTES, _REST_BYTES = 1_100, 1_200_000
REPLAYS_SHOWN = 12
"""The rest of the replays is folded away."""
SCRIPTS = tuple(
    f"{name}.js"
    for name in ("recorded", "road", "vehicles", "strips", "screen", "player", "controls", "clips", "tables")
)
"""In the order in which they use one another."""
QUICK = "Quick run: fewer training steps than table 1; not for conclusions."


@dataclass(frozen=True)
class StageRow:
    """One stage of the manifest, in words."""

    name: str
    kind: str
    seed: str
    status: str
    steps: str
    stopped: str
    duration: str
    message: str


def render_page(
    manifest: Mapping[str, Any],
    episodes: pd.DataFrame,
    summary: pd.DataFrame,
    comparisons: pd.DataFrame,
    training: pd.DataFrame,
    replays: Sequence[str],
    games: Iterable[RecordedGame] = (),
    scene: SceneDrawing | None = None,
    manoeuvres: pd.DataFrame | None = None,
    game: GameFindings | None = None,
    populations: pd.DataFrame | None = None,
    reconfiguration: pd.DataFrame | None = None,
) -> str:
    """The report as HTML. Equal input gives equal text.

    `manifest` is the content of manifest.json, the frames are those of the CSV files with the columns of
    `harness.evaluation.tables.TABLES`, `replays` the names of the folders under `replays/`, in any order. `games`, the ones
    to watch first on top, are taken until the page is full (`PAGE_BYTES`); without a `scene` there are none.
    Without `manoeuvres` nothing is said of them, without `game` nothing of equilibria, without `reconfiguration`
    nothing of searches.
    Raises ValueError when a frame is none of those tables.
    """
    episodes, summary, comparisons, training = map(typed, (episodes, summary, comparisons, training))
    manoeuvres = typed(manoeuvres) if manoeuvres is not None else None
    searched = typed(pd.DataFrame(columns=list(RECONFIGURATION_COLUMNS)) if reconfiguration is None else reconfiguration)
    found = results(manifest, episodes, summary, comparisons, populations)
    named = (*manifest.get("personas", ()), *comparisons["persona"], *summary["persona"])
    personas = [name for name in dict.fromkeys(named) if name]
    stages = manifest.get("stages", {})
    errored = episodes[unplayed(episodes)]
    in_table = episodes if len(episodes) <= MOST_ROWS else episodes[:0]
    section = game_section(game)
    taken = _REST_BYTES + len(in_table) * _ROW_BYTES + (section.bytes if section else 0)
    room = max(min(GAMES_BYTES, PAGE_BYTES - taken), 0)
    embedded = Embedded(scene, games, marks_of(manoeuvres), room)
    shown = embedded.keys
    arms, pairs = failures_by_pair(manoeuvres, episodes) if manoeuvres is not None else ([], None)
    tables = {
        "comparisons": table("comparisons", "Every test of the campaign.", comparisons),
        "summary": table("summary", "A row per arm and training seed.", summary),
        "training": table("training", "A row per window of a learning curve.", training),
        "episodes": table("episodes", "A row per game.", in_table),
    }
    if len(searched):
        caption = "A row per trial and parameter of a search."
        tables["reconfiguration"] = table("reconfiguration", caption, searched)
    environment = Environment(
        loader=PackageLoader("harness", "reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("report.html.jinja").render(
        name=manifest.get("name", "campaign"),
        quick=QUICK if manifest.get("quick") else "",
        trained_before=manifest.get("campaign", {}).get("policies") or "",
        unfinished=[_stage(name, stage) for name, stage in stages.items() if stage.get("status") not in ("done", "settled")],
        mixed=mixed_versions(stages),
        errored=errored.groupby(["arm", "seed"], sort=False).size().items(),
        errors=len(errored),
        facts=_facts(manifest, found.seeds, len(personas)),
        several_seeds=len(found.seeds) > 1,
        game=section,
        cards=[
            card(persona, place, found, worst_game(f"naive_vs_{persona}", episodes, shown))
            for place, persona in enumerate(personas, 1)
        ],
        learning=learning(stages, training),
        searches=searches(searched),
        change=found.change,
        rules=sorted({stage["rule"] for stage in stages.values() if stage.get("rule")}),
        stages=[_stage(name, stage) for name, stage in stages.items()],
        tables=tables,
        games=len(episodes),
        most_rows=MOST_ROWS,
        most_listed=MOST_LISTED,
        most_dots=MOST_DOTS if episodes.groupby("arm").size().max() > MOST_DOTS else 0,
        replays=replay_list(replays, episodes, shown),
        replays_shown=REPLAYS_SHOWN,
        unlisted=failures(episodes) - failures(episodes, replays),
        embedded=shown,
        left=len(episodes) - len(errored) - len(shown),
        keys=keys(in_table),
        key=key,
        pairs=pairs,
        pair_arms=arms,
        recorded=embedded.document(),
        script=Markup("\n").join(Markup(_source(environment, name)) for name in SCRIPTS),
        versions=manifest.get("versions", {}),
        glossary=_glossary(list(dict.fromkeys(summary["arm"])), personas),
        significance=found.significance,
        tests=int(comparisons["p_value"].notna().sum()),
    )
    return page.strip() + "\n"


def _source(environment: Environment, name: str) -> str:
    """A file beside the template, as it is: a script is no template."""
    assert environment.loader is not None
    return environment.loader.get_source(environment, name)[0].rstrip()


def _facts(manifest: Mapping[str, Any], seeds: Sequence[int], personas: int) -> list[tuple[str, str]]:
    campaign = manifest.get("campaign", {})
    stages = manifest.get("stages", {}).values()
    assessment, training = campaign.get("assessment", {}), campaign.get("training", {})
    ego = str(campaign.get("ego", {}).get("driver", ""))
    facts = [
        ("Scene", str(campaign.get("scene", "")).rstrip("/").rsplit("/", 1)[-1]),
        ("Ego", str((manifest.get("ego_driver") or {}).get("in_words") or ego)),
        ("Rounds", "" if ego in ("", "learned") else _rounds(stages)),
        ("Personas", str(personas)),
        ("Training seeds", ", ".join(map(str, manifest.get("seeds", seeds)))),
        ("Games per arm and seed", f"{assessment['episodes']:,}" if "episodes" in assessment else ""),
        ("Players", "trained before" if campaign.get("policies") else ""),
        ("Training budget", f"{steps_text(training['steps'])} steps" if "steps" in training else ""),
        ("Significance", f"{assessment['significance']:g}" if "significance" in assessment else ""),
    ]
    return [(label, value) for label, value in facts if value]


def _rounds(stages: Iterable[Mapping[str, Any]]) -> str:
    """The rounds of an ego that is not trained."""
    if any(stage.get("kind") == "reconfiguration" for stage in stages):
        return "0, 1 and 2: this ego is not trained, but its parameters are tuned"
    return "0 and 1: there is nothing to train or to tune in this ego"


def _stage(name: str, stage: Mapping[str, Any]) -> StageRow:
    steps, budget = stage.get("steps"), stage.get("budget_steps")
    return StageRow(
        name,
        str(stage.get("kind", "")),
        str(stage.get("seed", "")),
        str(stage.get("status", "")),
        "–" if steps is None else f"{steps:,}" + (f" of {budget:,}" if budget is not None else ""),
        stopped(stage),
        duration(stage.get("seconds")),
        str(stage.get("message") or ""),
    )


def duration(seconds: float | None) -> str:
    """E.g. "1 h 02 min", "3 min 05 s" or "12.3 s"; "–" when not known."""
    if seconds is None:
        return "–"
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def _glossary(arms: Sequence[str], personas: Sequence[str]) -> list[tuple[str, str]]:
    meanings = {
        "naive_alone": "the naive ego on the road without the non-ego",
        "naive_vs_sumo": "the naive ego, and an ordinary law-abiding SUMO driver in the non-ego's place",
    }
    for persona in personas:
        meanings |= {
            f"{persona}_alone": f"the non-ego {persona} without the ego",
            f"naive_vs_{persona}": f"the naive ego against the non-ego {persona}",
            f"reconfigured_vs_{persona}": f"the ego tuned against {persona}, against the same {persona}",
            f"reconfigured_alone_{persona}": f"the ego tuned against {persona}, without the non-ego",
            f"retrained_vs_{persona}": f"the ego retrained against {persona}, against the same {persona}",
            f"retrained_alone_{persona}": f"the ego retrained against {persona}, without the non-ego",
        }
    return [(arm, meanings.get(arm) or _of_strategies(arm)) for arm in arms]


def _of_strategies(arm: str) -> str:
    """What an arm beside the paper's rounds is of, by its name."""
    for ending, player in (("_non_ego_response", "the non-ego"), ("_ego_response", "the ego")):
        if arm.endswith(ending):
            return f"{arm.removesuffix(ending)}, {player} replaced by its best response"
    ego, against, non_ego = arm.partition("_vs_")
    return f"the ego {ego} against the non-ego {non_ego}" if against else f"{arm.removesuffix('_alone')} alone on the road"
