"""The table of docs/robust.md, from the tables of a run of campaigns/merge-robust.toml or one like it.

    python docs/robust/robust_egos.py persons reports/merge-robust     # naive and robust ego against every person
    python docs/robust/robust_egos.py bounds reports/merge-robust      # what the robust ego must reach, and whether
    python docs/robust/robust_egos.py compare reports/merge-robust reports/merge-robust-apart      # one training, or 8

Each command prints a table in Markdown. Rates are over all training seeds, with Clopper-Pearson's 95 % interval; the
games of the seeds start the same, so the intervals are about these trainings.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer
from scipy.stats import binomtest

HARD_BRAKING_MPS2 = 7.5
RESPONSE = "_non_ego_response"  # the end of the name of an arm
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
Run = Annotated[Path, typer.Argument(metavar="RUN", help="The folder of a run.")]
Apart = Annotated[Path, typer.Argument(metavar="RUN", help="The same with a training for each persona.")]


def games_of(run: Path) -> pd.DataFrame:
    """The rows of `episodes.csv` that could be played."""
    plain, packed = run / "episodes.csv", run / "episodes.csv.gz"
    episodes = pd.read_csv(plain if plain.is_file() else packed, low_memory=False)
    return episodes[episodes["ego_outcome"] != "error"].astype({"ego_failed": bool})


def rate(marked: pd.Series) -> str:
    """A share with its interval, in percent."""
    count, games = int(marked.sum()), len(marked)
    low, high = binomtest(count, games).proportion_ci(method="exact")
    return f"{count / games:.1%} ({low:.1%} to {high:.1%})"


def personas_of(run: Path) -> tuple[list[str], list[str]]:
    """The personas of a run, and those that the robust ego has met in training."""
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    return list(manifest["personas"]), list(manifest["campaign"]["retraining"]["against"])


@app.command()
def persons(run: Run) -> None:
    """Failure rates of the naive and the robust ego against every person, and how often the latter is worse."""
    games, (names, met) = games_of(run), personas_of(run)
    print("| person | met in training | naive ego fails | robust ego fails | in its worst seed | worse in seeds |")
    print("| --- | --- | --- | --- | ---: | ---: |")
    for person in ("nobody", "sumo", *names):
        arms = [f"{ego}_alone" if person == "nobody" else f"{ego}_vs_{person}" for ego in ("naive", "robust")]
        naive, robust = (games[games["arm"] == arm] for arm in arms)
        of_seeds = [own.groupby("seed")["ego_failed"].mean() for own in (naive, robust)]
        worse = f"{int((of_seeds[1] > of_seeds[0]).sum())} of {len(of_seeds[1])}"
        known = "" if person == "nobody" else ("yes" if person in met else "no")
        rates = rate(naive["ego_failed"]), rate(robust["ego_failed"]), f"{of_seeds[1].max():.1%}"
        print(f"| {' | '.join((person, known, *rates, worse))} |")


@app.command()
def bounds(run: Run) -> None:
    """What the robust ego must reach, and what it does: the worst person of each bound."""
    games, (names, met) = games_of(run), personas_of(run)
    games = games.assign(brakes_hard=games["ego_max_deceleration_mps2"] > HARD_BRAKING_MPS2)

    def worst(column: str, among: list[str], response: str = "") -> str:
        marked = {name: games.loc[games["arm"] == f"robust_vs_{name}{response}", column] for name in among}
        name = max(marked, key=lambda each: marked[each].mean())
        return f"{rate(marked[name])} against {name}"

    answered = [name for name in names if f"robust_vs_{name}{RESPONSE}" in set(games["arm"])]
    by_response = worst("ego_failed", answered, RESPONSE) if answered else "not trained"
    naive, robust = (
        games.loc[games["arm"] == f"{ego}_alone", "ego_mean_speed_mps"].mean() for ego in ("naive", "robust")
    )
    lines = [
        ("fails against each person met in training", "≤ 1 %", worst("ego_failed", met)),
        ("fails against each other person", "≤ 2 %", worst("ego_failed", [each for each in names if each not in met])),
        ("fails against a best response of each person", "≤ 3 %", by_response),
        ("failures that the regulation's driver prevents", "≤ 0.5 % of games", _preventable(run)),
        ("slower alone than the naive ego", "≤ 2 %", f"{1.0 - robust / naive:.1%}"),
        (f"brakes harder than {HARD_BRAKING_MPS2:g} m/s²", "≤ 5 % of games", worst("brakes_hard", names)),
    ]
    print("| the robust ego | must | at worst |")
    print("| --- | --- | --- |")
    for line in lines:
        print(f"| {' | '.join(line)} |")


@app.command()
def compare(run: Run, apart: Apart) -> None:
    """Failure rates where all personas learned in one training, and where each learned alone, of the same seeds."""
    together, alone = games_of(run), games_of(apart)
    together = together[together["seed"].isin(alone["seed"].unique())]
    names, _ = personas_of(apart)
    print("| person | naive ego fails: together | apart | points | robust ego fails: together | apart | points |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for person in names:
        cells = []
        for ego in ("naive", "robust"):
            shares = [own.loc[own["arm"] == f"{ego}_vs_{person}", "ego_failed"].mean() for own in (together, alone)]
            cells += [*(f"{share:.1%}" for share in shares), f"{100 * (shares[0] - shares[1]):+.1f}"]
        print(f"| {' | '.join((person, *cells))} |")


def _preventable(run: Path) -> str:
    """The largest rates of failures that the driver of UN R157 prevents, from the danger on and from the start."""
    found = pd.read_csv(run / "preventability.csv")
    own = found[(found["driver"] == "careful_and_competent") & found["arm"].str.startswith("robust_vs_")]
    counts = own.groupby("arm")[["from_conflict_prevented", "from_start_prevented", "episodes"]].sum()
    shares = counts.div(counts["episodes"], axis=0).max().fillna(0.0)
    conflict, start = shares["from_conflict_prevented"], shares["from_start_prevented"]
    return f"{conflict:.2%} from the danger on, {start:.2%} from the start"


if __name__ == "__main__":
    app()
