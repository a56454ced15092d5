"""Reports of made-up campaigns: their tables, the rendered page, and what it holds."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from harness.campaign.plan.paper_rounds import questions
from harness.config.campaign import Campaign
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.comparison import compare
from harness.evaluation.comparisons.over_trainings import compare_over_trainings
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import DID_NOT_LEARN, ResearchQuestion
from harness.evaluation.strategies import (
    NAIVE_ALONE,
    NAIVE_VS_SUMO,
    Arm,
    NaiveEgo,
    PersonaNonEgo,
    RetrainedEgo,
    Strategy,
    against_persona,
    persona_alone,
    strategy_name,
)
from harness.evaluation.tables import table_of, typed
from harness.evaluation.worst_first import choose_games, replay_name
from harness.reports.embedding import GameTracks
from harness.reports.page import render_page
from harness.reports.run_tables import RunTables
from tests.support.recorded import SCENE, causes, manoeuvres, recorded
from tests.support.tiny import UNGATED

GAMES = 60
FAILING = {"alone": 0.0, "sumo": 0.03, "naive": 0.3, "retrained": 0.03}


def campaign(
    personas: Sequence[str] = ("speedy", "distracted"),
    seeds: Sequence[int] = (1,),
    failing: dict[str, float] | None = None,
    games: int = GAMES,
    quick: bool = False,
    retrained: bool = True,
) -> dict[str, Any]:
    """The fields of RunTables for a made-up campaign, its tables computed as those of a real one.

    `failing` overrides FAILING: the share of games the ego fails, by kind of arm.
    """
    rates = FAILING | (failing or {})
    arms: dict[Arm, tuple[str, str | None]] = {NAIVE_ALONE: ("", "alone"), NAIVE_VS_SUMO: ("", "sumo")}
    strategies: list[Strategy] = [NaiveEgo()]
    for persona in personas:
        arms |= {persona_alone(persona): (persona, None), against_persona(NaiveEgo(), persona): (persona, "naive")}
        strategies.append(PersonaNonEgo(persona=persona))
        if retrained:
            ego = RetrainedEgo(against=persona)
            arms |= {against_persona(ego, persona): (persona, "retrained"), Arm(ego=ego): (persona, "alone")}
            strategies.append(ego)
    random = np.random.default_rng(7)
    rows = [
        _game(arm.name, persona, seed, episode, rates.get(kind or ""), random)
        for arm, (persona, kind) in arms.items()
        for seed in seeds
        for episode in range(games)
    ]
    episodes = table_of("episodes", rows)
    stages = [strategy_name(each) for each in strategies]
    training = pd.DataFrame([row for stage in stages for seed in seeds for row in _windows(stage, seed, random)])
    manifest = {
        "format": 1,
        "name": "merge",
        "quick": quick,
        "seeds": list(seeds),
        "personas": list(personas),
        "versions": {"harness": "0.1.0", "sumo": "1.28.0"},
        "campaign": {
            "name": "merge",
            "scene": "../networks/merge",
            "ego": {"driver": "learned"},
            "training": {"steps": 3_000_000},
            "assessment": {"episodes": games, "significance": 0.01},
        },
        "stages": {f"{stage}-seed{seed}": _training_stage(seed) for stage in stages for seed in seeds}
        | {f"{arm.name}-seed{seed}": _done(seed) for arm in arms for seed in seeds},
    }
    replays = [
        replay_name(game["arm"], game["seed"], game["episode"]) for game in choose_games(episodes).to_dict("records")
    ]
    return {
        "manifest": manifest,
        "arms": {arm.name: arm for arm in arms},
        "strategies": {strategy_name(each): each for each in strategies},
        "episodes": episodes,
        "summary": summarise(episodes),
        **_compared(manifest, episodes, {"RQ1", "RQ2"} if retrained else {"RQ1"}),
        "training": typed(training),
        "replays": replays,
    }


def starts(episodes: int = GAMES) -> pd.DataFrame:
    """The starts of such a campaign. Those of later games are farther ahead: `campaign` lets the first ones fail."""
    random = np.random.default_rng(3)
    quantities = {
        "non_ego_ahead_m": np.arange(episodes) - 8.0,
        "non_ego_faster_mps": random.uniform(-3.0, 3.0, episodes),
        "ego_speed_mps": random.uniform(11.0, 14.0, episodes),
    }
    return pd.DataFrame(quantities, index=pd.RangeIndex(episodes, name="episode"))


def _compared(
    manifest: Mapping[str, Any],
    episodes: pd.DataFrame,
    asked: Collection[ResearchQuestion],
    competence: Mapping[str, float] = UNGATED,
) -> dict[str, pd.DataFrame]:
    """The answers of the episodes to these questions, for each pair and over trainings; `competence` is the table of a
    campaign."""
    document = {"name": "a", "scene": "b", "personas": ["x.toml"], "seeds": manifest["seeds"], "competence": competence}
    of_campaign = questions(Campaign.model_validate(document), manifest["personas"])
    planned = [each for each in of_campaign if each.question in asked]
    over = compare_over_trainings(planned, episodes, 0.01)
    return {"comparisons": compare(planned, episodes, 0.01), "over_trainings": over}


def _game(
    arm: str, persona: str, seed: int, episode: int, failing: float | None, random: np.random.Generator
) -> dict[str, Any]:
    row: dict[str, Any] = {
        "arm": arm,
        "persona": persona,
        "seed": seed,
        "episode": episode,
        "duration_s": random.uniform(9, 14),
    }
    row |= {"ego_outcome": "", "non_ego_outcome": "", "error": ""}
    if failing is not None:
        failed = episode < failing * GAMES
        cause = ("collision", "rail", "timeout")[episode % 3]
        row |= {"ego_outcome": cause if failed else "goal", "ego_failed": int(failed)}
        row |= {
            "ego_mean_speed_mps": random.normal(13.2, 0.8) - 3 * failed,
            "ego_max_deceleration_mps2": random.uniform(1, 8),
            "ego_max_lateral_acceleration_mps2": random.uniform(0, 2),
            "ego_time_to_goal_s": math.nan if failed else random.uniform(9, 14),
            "ego_payoff": random.normal(8, 1) - 12 * failed,
        }
    if "_vs_" in arm:
        row |= {"ego_trailing_distance_m": random.uniform(2, 30)}
        row |= {"ego_min_ttc_s": random.uniform(0.2, 8) if episode % 4 else math.nan}
    if "_vs_" in arm or failing is None:
        row |= {"non_ego_outcome": "goal" if random.uniform() < 0.97 else "rail"}
        row |= {"non_ego_mean_speed_mps": random.normal(15, 1), "non_ego_payoff": random.normal(10, 2)}
    severities = {"collision": 300.0, "rail": 200.0, "timeout": 100.0}
    return row | {"severity": severities.get(row["ego_outcome"] or row["non_ego_outcome"], 0.0)}


def _windows(stage: str, seed: int, random: np.random.Generator) -> Iterator[dict[str, Any]]:
    persona = stage.removeprefix("retrained_") if stage != "naive" else ""
    for window in range(1, 10):
        yield {
            "stage": stage,
            "persona": persona,
            "seed": seed,
            "steps": window * 131_072,
            "mean_payoff": 10 - 25 * math.exp(-window / 2) + random.normal(0, 0.4),
            "failure_rate": min(1, math.exp(-window / 2) + abs(random.normal(0, 0.01))),
            "games": 900,
            "mean_duration_s": 11.5,
            "stopped": "converged" if window == 9 else "",
        }


@contextmanager
def blank_figures() -> Iterator[None]:
    """Lay figures out but draw them blank: drawing takes most of a page's time, and tests of its text don't need it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, file, **_: file.write('<svg viewBox="0 0 1 1"></svg>'))
        yield


def rendered(games: Sequence[GameTracks] = (), scene: Mapping[str, Any] | None = None, **tables: Any) -> str:
    """The report of these tables, as `campaign` makes them."""
    return render_page(RunTables(**tables), games, scene)


def recordings(arguments: Mapping[str, Any], background: int = 2) -> dict[str, Any]:
    """What `rendered` takes beside a campaign: recorded games that fit it, their manoeuvres and causes of failures."""
    episodes = arguments["episodes"]
    games = recorded(episodes, background)
    return {"games": games, "scene": SCENE, "manoeuvres": manoeuvres(episodes), "causes": causes(episodes)}


def _done(seed: int) -> dict[str, Any]:
    return {"kind": "assessment", "seed": seed, "status": "done", "seconds": 12.34, "message": ""}


def _training_stage(seed: int) -> dict[str, Any]:
    trained = {"steps": 1_179_648, "budget_steps": 3_000_000, "stopped": "converged", "rule": "the curve is flat"}
    return {"kind": "training", "seed": seed, "status": "done", "seconds": 3725.0, "message": ""} | trained


def plain(text: str) -> str:
    """A sentence of a page with ordinary spaces."""
    return text.replace("\N{NO-BREAK SPACE}", " ")


class Page(HTMLParser):
    """What a test asks of a page: its text, its tables by id, every tag with its attributes."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.pieces: list[str] = []
        self.tables: dict[str | None, list[list[dict[str, Any]]]] = {}
        self._table: list[list[dict[str, Any]]] = []
        self._cell: dict[str, Any] | None = None
        self._silent = 0
        self.feed(html)
        self.text = " ".join("".join(self.pieces).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        self._silent += tag in ("style", "script")
        if tag == "table":
            self._table = self.tables.setdefault(attributes.get("id", f"table {len(self.tables)}"), [])
        elif tag == "tr":
            self._table.append([])
        elif tag in ("td", "th"):
            self._cell = {"exact": attributes.get("data-order", attributes.get("data-column")), "text": ""}
            self._table[-1].append(self._cell)

    def handle_endtag(self, tag: str) -> None:
        self._silent -= tag in ("style", "script")
        if tag in ("td", "th"):
            self._cell = None

    def handle_data(self, data: str) -> None:
        if not self._silent:
            self.pieces.append(data)
        if self._cell is not None:
            self._cell["text"] += data

    def cells(self, name: str) -> list[list[str | None]]:
        """A table of the page as the CSV file should have it, its header first."""
        return [[cell["text"] if cell["exact"] is None else cell["exact"] for cell in row] for row in self.tables[name]]


def with_errors(arguments: dict[str, Any], games: Any) -> dict[str, Any]:
    """The campaign with `games`, a mask over its episodes, that could not be played."""
    frame = arguments["episodes"]
    frame.loc[games, "ego_outcome"] = "error"
    frame.loc[games, "error"] = "the simulator died"
    measured = [name for name, column in TABLES["episodes"].items() if column.dtype in ("float64", "Int64")]
    frame.loc[games, measured] = None
    return recomputed(arguments)


def recomputed(arguments: dict[str, Any], competence: Mapping[str, float] = UNGATED) -> dict[str, Any]:
    """The campaign with tables that fit its changed episodes; `competence` is its table of that name."""
    episodes, asked = arguments["episodes"], set(arguments["comparisons"]["question"])
    return arguments | {"summary": summarise(episodes)} | _compared(arguments["manifest"], episodes, asked, competence)


def cannot_drive(arguments: dict[str, Any], seeds: Sequence[int] = (1,)) -> dict[str, Any]:
    """The campaign with a speedy driver that never reaches its goal alone, in these seeds. The naive ego can drive."""
    episodes = arguments["episodes"]
    episodes.loc[episodes["arm"] == NAIVE_VS_SUMO.name, "ego_outcome"] = "goal"
    alone = (episodes["arm"] == "speedy_alone") & episodes["seed"].isin(seeds)
    episodes.loc[alone, "non_ego_outcome"] = "rail"
    for seed in seeds:
        entry = arguments["manifest"]["stages"][f"speedy-seed{seed}"]
        entry |= {"stopped": DID_NOT_LEARN, "goals": 0, "played": GAMES, "goal_share_asked": 0.8}
    return recomputed(arguments, competence={})


def drawn_with(style: str, figure: str) -> int:
    """The number of shapes of a figure with a style, by their class or by themselves."""
    rules = dict(re.findall(r"\.([a-z]+){([^}]*)}", figure))
    of_class = [name for name in re.findall(r'class="([a-z]+)"', figure) if style in rules.get(name, "").split(";")]
    return len(of_class) + sum(style in each.split(";") for each in re.findall(r'style="([^"]*)"', figure))
