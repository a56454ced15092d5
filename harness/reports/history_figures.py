"""Failure rates over runs in their order: a picture for each ego, a line for each person that it meets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from harness.evaluation.comparisons.run_comparison import Side
from harness.evaluation.strategies import (
    Arm,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    strategy_name,
)
from harness.reports.failure_table import NOBODY, ORDINARY
from harness.reports.figures import SERIES, figure_of, svg
from harness.reports.numbers import interval

MOST_PEOPLE_SHOWN = 8
"""Of an ego; of more, those against which it fails most."""
_MARKERS = "osD^v<>P"
_OF_PERSONAS = ("persona", "retrained", "alone", "sumo")
_BASELINES = {NOBODY: "alone", ORDINARY: "sumo"}
"""The colours of lines: keys of `SERIES`."""


@dataclass(frozen=True, kw_only=True)
class PersonHistory:
    """How often one ego fails against one person in each run."""

    ego: str
    person: str
    rates: Sequence[Mapping[int, Side]]
    """For each run by training seed; empty where the run has not played it."""

    def counts(self, place: int) -> str:
        """Failures and games of a run, over all training seeds; empty where it was not played."""
        rates = self.rates[place].values()
        return f"{sum(each.failures for each in rates)} of {sum(each.games for each in rates)}" if rates else ""

    def interval(self, place: int) -> str:
        """The interval of the only training seed of a run; of several, their number."""
        rates = list(self.rates[place].values())
        return interval(rates[0].low, rates[0].high) if len(rates) == 1 else f"{len(rates)} seeds"

    def share(self, place: int) -> float:
        """The share of failures in a run, over all training seeds; NaN where it was not played."""
        rates = self.rates[place].values()
        games = sum(each.games for each in rates)
        return sum(each.failures for each in rates) / games if games else np.nan

    def text(self, place: int) -> str:
        """The cell of a run: counts over all training seeds, and the interval of the only one."""
        counts, ends = self.counts(place), self.interval(place)
        if not counts:
            return ""
        return f"{counts} ({ends})" if len(self.rates[place]) == 1 else f"{counts}, {ends}"


def histories(
    arms: Sequence[Mapping[str, Arm]], rates: Sequence[Mapping[tuple[str, int], Side]]
) -> list[PersonHistory]:
    """The histories of the arms that at least two runs have played, ego by ego, in the order of the runs."""
    named = {name: arm for of_run in arms for name, arm in of_run.items() if _is_shown(arm)}
    found = []
    for name, arm in named.items():
        by_run = [{seed: rate for (of, seed), rate in run.items() if of == name} for run in rates]
        if sum(map(bool, by_run)) > 1:
            found.append(PersonHistory(ego=_ego(arm), person=_person(arm), rates=by_run))
    egos = list(dict.fromkeys(each.ego for each in found))
    return sorted(found, key=lambda each: egos.index(each.ego))


def _is_shown(arm: Arm) -> bool:
    """Whether an ego meets somebody with their own traits, or the naive ego nobody."""
    if arm.ego is None or arm.is_of_a_trait or arm.best_response_of is not None:
        return False
    return arm.non_ego is not None or isinstance(arm.ego, NaiveEgo)


def _ego(arm: Arm) -> str:
    match arm.ego, arm.non_ego:
        case NaiveEgo(), _:
            return "naive ego"
        case RobustEgo(), _:
            return "robust ego"
        case (RetrainedEgo(against=against), PersonaNonEgo(persona=persona)) if against == persona:
            return "retrained ego"
        case (ReconfiguredEgo(against=against), PersonaNonEgo(persona=persona)) if against == persona:
            return "reconfigured ego"
        case ego, _:
            assert ego is not None
            return strategy_name(ego)


def _person(arm: Arm) -> str:
    if arm.non_ego is None:
        return NOBODY
    return strategy_name(arm.non_ego) if isinstance(arm.non_ego, PersonaNonEgo) else ORDINARY


def history_figures(found: Sequence[PersonHistory], runs: Sequence[str]) -> Iterator[tuple[str, Markup]]:
    """A picture for each ego, with its name; a person looks the same in all. `runs` are the labels of the axis."""
    personas = [person for person in dict.fromkeys(each.person for each in found) if person not in _BASELINES]
    for place, ego in enumerate(dict.fromkeys(each.ego for each in found)):
        people = [each for each in found if each.ego == ego]
        worst = sorted(people, key=lambda each: -np.nanmax([each.share(run) for run in range(len(runs))]))
        shown = [each for each in people if each in worst[:MOST_PEOPLE_SHOWN]]
        yield ego, _figure(shown, personas, runs, f"history{place}")


def _style(person: str, personas: Sequence[str]) -> tuple[str, str, str]:
    """Colour, marker and dashes of a person's line."""
    if person in _BASELINES:
        return SERIES[_BASELINES[person]], ".", ":"
    place = personas.index(person)
    dashes = "-" if place < len(_OF_PERSONAS) // 2 else "--"
    return SERIES[_OF_PERSONAS[place % len(_OF_PERSONAS)]], _MARKERS[place % len(_MARKERS)], dashes


def _figure(people: Sequence[PersonHistory], personas: Sequence[str], runs: Sequence[str], name: str) -> Markup:
    places = range(len(runs))
    texts = [f"{each.person} {', '.join(each.text(place) or 'not played' for place in places)}" for each in people]
    with figure_of(5.4, 3.6) as figure:
        axes = figure.subplots()
        tops = [0.05]
        for line, person in enumerate(people):
            x = np.array(places) + 0.05 * (line - 0.5 * (len(people) - 1))
            shares = np.array([person.share(place) for place in places])
            known = np.isfinite(shares)
            colour, marker, dashes = _style(person.person, personas)
            axes.plot(x[known], shares[known], dashes, marker=marker, color=colour, markersize=5, label=person.person)
            for run, by_seed in enumerate(person.rates):
                for number, rate in enumerate(by_seed.values()):
                    at = x[run] + 0.012 * (number - 0.5 * (len(by_seed) - 1))
                    axes.plot([at, at], [rate.low, rate.high], color=colour, linewidth=1.2, alpha=0.6)
                    tops.append(rate.high)
        axes.set_ylim(0, max(tops) * 1.05)
        axes.set_xlim(-0.4, len(runs) - 0.6)
        axes.set_xticks(places, runs)
        if len(runs) > 3:
            axes.tick_params(axis="x", labelrotation=20)
        axes.yaxis.set_major_formatter(lambda share, _: f"{share * 100:.3g}")
        axes.set_ylabel("failure rate (%)")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False, fontsize=9)
        return svg(figure, name, f"Failures in each run. {'; '.join(texts)}")
