"""How egos drive on roads on which they did not learn.

    python docs/roads/held_out.py play                   # draws roads, trains egos, and plays them: an hour on one core
    python docs/roads/held_out.py table reports/roads    # the results as a Markdown table

One naive ego learns on the road of a scene, the other also on eight variants of it. Both play on ten other variants.
The table has for each of them, and each person there, the share of games in which the ego fails, the roads with a
failure, and the failures on the worst road. Beside others, roads on which the ego fails alone are left out: they say
nothing about how it copes with others.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from scipy.stats import binomtest

from harness.evaluation.league_columns import NOBODY
from harness.evaluation.tables import read_csv

SCENES = ("merge", "left_across", "priority_crossing")
SEED, GAMES = 141, 20
LEARNED, HELD_OUT = range(1, 9), range(111, 121)
LEARNS_ON = {"one-road": [], "nine-roads": LEARNED}
CAMPAIGN = """name = "{name}"
scene = "{scene}"
personas = []
seeds = [{seed}]
roads = {roads}
"""
FOLDER = Path("reports/roads")
HEADER = ("scene", "ego learned on", "beside", "roads", "games", "ego fails", "roads with a failure", "worst road")
app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.command()
def play() -> None:
    """Draw the roads, train the egos, and play their leagues. Run it again to continue."""
    for scene in SCENES:
        for seeds, folder in ((LEARNED, FOLDER / "learned"), (HELD_OUT, FOLDER / "held-out")):
            if not (folder / f"{scene}_road{seeds[0]}").is_dir():
                _run("scene", "vary", scene, "--roads", len(seeds), "--seed", seeds[0], "--out", folder)
        held_out = ",".join(str(FOLDER / "held-out" / f"{scene}_road{seed}") for seed in HELD_OUT)
        for words in LEARNS_ON:
            run, out = FOLDER / f"{scene}-{words}", FOLDER / f"{scene}-learned-on-{words}"
            document, ego = run.with_suffix(".toml"), run / "policies" / f"naive-seed{SEED}"
            document.write_text(campaign_of(scene, words), encoding="utf-8")
            _run("campaign", document, "--out", run)
            _run("league", "--ego", ego, "--scenes", held_out, "--episodes", GAMES, "--out", out)


def campaign_of(scene: str, words: str) -> str:
    """The campaign in which an ego learns on one road, or on nine."""
    roads = [f"learned/{scene}_road{seed}" for seed in LEARNS_ON[words]]
    return CAMPAIGN.format(name=f"{scene}-{words}", scene=scene, seed=SEED, roads=roads)


def _run(*words: object) -> None:
    subprocess.run(["harness", *map(str, words)], check=True)


@app.command()
def table(folder: Annotated[Path, typer.Argument(help="The folder of the leagues.")] = FOLDER) -> None:
    """Print the table."""
    rows = [row for scene in SCENES for words in LEARNS_ON for row in rows_of(folder, scene, words)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(folder: Path, scene: str, words: str) -> Iterator[list[str]]:
    """A row for each person of a league, all roads together; beside others, roads on which the ego fails alone are left
    out."""
    league = read_csv(folder / f"{scene}-learned-on-{words}" / "league.csv")
    alone = league[league["person"] == NOBODY].set_index("scene")["failure_rate"]
    for person, of_person in league.groupby("person", sort=True):
        rows = of_person if person == NOBODY else of_person[of_person["scene"].map(alone) == 0.0]
        failed = (rows["failure_rate"] * rows["episodes"]).round().astype(int)
        games, failures = int(rows["episodes"].sum()), int(failed.sum())
        low, high = binomtest(failures, games).proportion_ci()
        share = f"{failures / games:.1%} ({low:.1%} to {high:.1%})"
        worst = f"{failed.max()} of {rows.loc[failed.idxmax(), 'episodes']}"
        with_failure = str(int((failed > 0).sum()))
        yield [scene, words, str(person), str(len(rows)), str(games), share, with_failure, worst]


if __name__ == "__main__":
    app()
