"""The report of a run as one HTML file: opens offline, loads nothing, and shows the numbers of the CSV files."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from harness.reports import wording
from harness.reports.cards import card, results, unplayed
from harness.reports.cells import table
from harness.reports.figures import Curve, learning_figure, steps_text
from harness.tables import typed

MOST_ROWS = 5_000
"""A table longer than this is left to its CSV file, and the page says so."""
REPLAYS_SHOWN = 12
"""The rest of the replays is folded away."""
FAILURES = ("collision", "rail", "timeout")
"""Outcomes in the order they are worth watching; games that went well follow."""

QUICK = "Quick run: fewer training steps than table 1; not for conclusions."


@dataclass(frozen=True)
class Stage:
    """One stage of the manifest, in words."""

    name: str
    kind: str
    seed: str
    status: str
    steps: str
    stopped: str
    duration: str
    message: str


@dataclass(frozen=True)
class Learning:
    """One training stage's curves."""

    stage: str
    figure: Markup
    stops: Sequence[str]


@dataclass(frozen=True)
class Replay:
    """A recorded game and how to watch it."""

    name: str
    game: str
    outcome: str
    min_ttc: str
    command: str
    scene: str


def render_page(
    manifest: Mapping[str, Any],
    episodes: pd.DataFrame,
    summary: pd.DataFrame,
    comparisons: pd.DataFrame,
    training: pd.DataFrame,
    replays: Sequence[str],
) -> str:
    """The report as HTML. Equal input gives equal text.

    `manifest` is the content of manifest.json, the frames are those of the CSV files with the columns of
    `harness.tables.TABLES`, `replays` the names of the folders under `replays/`, in any order.
    Raises ValueError when a frame is none of those tables.
    """
    episodes, summary, comparisons, training = map(typed, (episodes, summary, comparisons, training))
    found = results(manifest, episodes, summary, comparisons)
    named = (*manifest.get("personas", ()), *comparisons["persona"], *summary["persona"])
    personas = [name for name in dict.fromkeys(named) if name]
    stages = manifest.get("stages", {})
    errored = episodes[unplayed(episodes)]
    tables = {
        "comparisons": table("comparisons", "Every test of the campaign.", comparisons),
        "summary": table("summary", "A row per arm and training seed.", summary),
        "training": table("training", "A row per window of a learning curve.", training),
        "episodes": table("episodes", "A row per game.", episodes[:MOST_ROWS]),
    }
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
        unfinished=[_stage(name, stage) for name, stage in stages.items() if stage.get("status") != "done"],
        errored=errored.groupby(["arm", "seed"], sort=False).size().items(),
        errors=len(errored),
        facts=_facts(manifest, found.seeds, len(personas)),
        several_seeds=len(found.seeds) > 1,
        cards=[card(persona, place, found) for place, persona in enumerate(personas, 1)],
        learning=_learning(stages, training),
        rules=sorted({stage["rule"] for stage in stages.values() if stage.get("rule")}),
        stages=[_stage(name, stage) for name, stage in stages.items()],
        tables=tables,
        games=len(episodes),
        most_rows=MOST_ROWS,
        replays=_replays(replays, episodes),
        replays_shown=REPLAYS_SHOWN,
        versions=manifest.get("versions", {}),
        glossary=_glossary(list(dict.fromkeys(summary["arm"])), personas),
        significance=found.significance,
        tests=int(comparisons["p_value"].notna().sum()),
    )
    return page.strip() + "\n"


def _facts(manifest: Mapping[str, Any], seeds: Sequence[int], personas: int) -> list[tuple[str, str]]:
    campaign = manifest.get("campaign", {})
    assessment, training = campaign.get("assessment", {}), campaign.get("training", {})
    facts = [
        ("Scene", str(campaign.get("scene", "")).rstrip("/").rsplit("/", 1)[-1]),
        ("Ego", str(campaign.get("ego", {}).get("driver", ""))),
        ("Personas", str(personas)),
        ("Training seeds", ", ".join(map(str, manifest.get("seeds", seeds)))),
        ("Games per arm and seed", f"{assessment['episodes']:,}" if "episodes" in assessment else ""),
        ("Training budget", f"{steps_text(training['steps'])} steps" if "steps" in training else ""),
        ("Significance", f"{assessment['significance']:g}" if "significance" in assessment else ""),
    ]
    return [(label, value) for label, value in facts if value]


def _stage(name: str, stage: Mapping[str, Any]) -> Stage:
    steps, budget = stage.get("steps"), stage.get("budget_steps")
    return Stage(
        name,
        str(stage.get("kind", "")),
        str(stage.get("seed", "")),
        str(stage.get("status", "")),
        "–" if steps is None else f"{steps:,}" + (f" of {budget:,}" if budget is not None else ""),
        _stopped(stage),
        duration(stage.get("seconds")),
        str(stage.get("message") or ""),
    )


def _stopped(stage: Mapping[str, Any]) -> str:
    stopped = stage.get("stopped")
    return {"converged": "early: converged", "budget": "budget used", None: "–"}.get(stopped, str(stopped))


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


def _learning(stages: Mapping[str, Any], training: pd.DataFrame) -> list[Learning]:
    """A figure per training stage, in order of first appearance, with a curve per seed."""
    figures = []
    for place, stage in enumerate(training["stage"].unique(), 1):
        curves, stops = [], []
        rows = training[training["stage"] == stage]
        for seed, windows in rows.groupby("seed", sort=True):
            of_manifest = stages.get(f"{stage}-seed{seed}", {})
            windows = windows.sort_values("steps")
            curves.append(
                Curve(
                    int(seed),
                    windows["steps"].tolist(),
                    windows["mean_payoff"].tolist(),
                    windows["failure_rate"].tolist(),
                    of_manifest.get("steps"),
                    of_manifest.get("stopped") == "converged",
                )
            )
            if of_manifest.get("steps") is not None:
                stop = f"{of_manifest['steps']:,} steps ({_stopped(of_manifest)})"
                stops.append(f"seed {seed}: {stop}" if rows["seed"].nunique() > 1 else stop)
        series = "alone" if stage == "naive" else "retrained" if stage.startswith("retrained_") else "persona"
        last = [f"seed {curve.seed} ends at mean payoff {curve.payoffs[-1]:.3g}" for curve in curves]
        alternative = f"Learning curve of {stage}: mean payoff and failure rate over training steps; "
        figures.append(
            Learning(stage, learning_figure(curves, series, f"curve{place}", alternative + "; ".join(last)), stops)
        )
    return figures


def _replays(names: Sequence[str], episodes: pd.DataFrame) -> list[Replay]:
    """The replays, worst first, in the order of `harness.replay.choice.worst_first`, which reports can't import."""
    games = {f"{game['arm']}-seed{game['seed']}-{game['episode']:03d}": game for game in episodes.to_dict("records")}
    several_seeds = episodes["seed"].nunique() > 1
    known = [(name, games[name]) for name in names if name in games]
    known.sort(key=lambda pair: _worst(pair[1]))
    shown = [_replay(name, game, several_seeds) for name, game in known]
    strangers = sorted(set(names) - set(games))
    return shown + [Replay(name, name, "–", "–", "", _scene(name)) for name in strangers]


def _worst(game: Mapping[Any, Any]) -> tuple[Any, ...]:
    outcome, ttc = game["ego_outcome"] or game["non_ego_outcome"], game["ego_min_ttc_s"]
    severity = FAILURES.index(outcome) if outcome in FAILURES else len(FAILURES) + (outcome == "error")
    return severity, ttc if ttc == ttc else float("inf"), game["arm"], game["seed"], game["episode"]


def _replay(name: str, game: Mapping[Any, Any], several_seeds: bool) -> Replay:
    arm, seed, episode = game["arm"], game["seed"], game["episode"]
    judged = "ego" if game["ego_outcome"] else "non-ego"
    return Replay(
        name,
        f"{arm}, seed {seed}, game {episode}" if several_seeds else f"{arm}, game {episode}",
        f"{judged}: {game['ego_outcome'] or game['non_ego_outcome']}",
        wording.number(game["ego_min_ttc_s"], 2),
        f"harness replay . {shlex.quote(arm)} {episode}" + (f" --seed {seed}" if several_seeds else ""),
        _scene(name),
    )


def _scene(name: str) -> str:
    return f"sumo-gui -c {shlex.quote(f'replays/{name}/scene.sumocfg')}"


def _glossary(arms: Sequence[str], personas: Sequence[str]) -> list[tuple[str, str]]:
    meanings = {
        "naive_alone": "the naive ego on the road without the non-ego",
        "naive_vs_sumo": "the naive ego, and an ordinary law-abiding SUMO driver in the non-ego's place",
    }
    for persona in personas:
        meanings |= {
            f"{persona}_alone": f"the non-ego {persona} without the ego",
            f"naive_vs_{persona}": f"the naive ego against the non-ego {persona}",
            f"retrained_vs_{persona}": f"the ego retrained against {persona}, against the same {persona}",
            f"retrained_alone_{persona}": f"the ego retrained against {persona}, without the non-ego",
        }
    return [(arm, meanings[arm]) for arm in arms if arm in meanings]
