"""What a row of `gaps` says in words: a player's gain, what the search had, and how often the ego fails."""

from __future__ import annotations

import math
from collections.abc import Sequence

from harness.evaluation.game_theory.best_response_gap import OWN, SEARCH
from harness.evaluation.gap_verdict import GapVerdict
from harness.reports.numbers import MINUS, NO_SPACE, SURE, interval, number, p_text, percent, signed, sure
from harness.reports.run_tables import Row
from harness.wording import counted


def both_sides(persona: str, ego: Row | None, non_ego: Row | None) -> str:
    """The gain of each side of a pair as clauses; None: no best response of it was trained."""
    driver = f"the {persona} driver"
    gains = [each for each in (ego, non_ego) if each is not None and each["verdict"] == GapVerdict.DISTINGUISHABLE]
    if non_ego is not None and [math.isfinite(each["gap_share"]) for each in gains] == [True, True]:
        return f"{_side('the ego', ego)}; {driver} {_share(non_ego)}{_by_playing(non_ego)}"
    return f"{_side('the ego', ego)}; {_side(driver, non_ego)}"


def induced_failures(row: Row) -> str:
    """How often the ego fails against the best known response of a persona to it."""
    games, rate = row["pairs"], row["ego_failure_rate_best_response"]
    if not games:
        return f"The effect of a {row['persona']} driver newly trained against this ego was not measured."
    if row["best_known"] == OWN:
        return f"Nothing is known by which a {row['persona']} driver earns more against this ego than it does."
    span = sure(row["ego_failure_rate_best_response_low"], row["ego_failure_rate_best_response_high"])
    counts = f"{round(rate * games)} of {games} games ({percent(rate)}; {span})"
    text = f"{_responding(str(row['persona']), row)} {counts} instead of {round(row['ego_failure_rate'] * games)}"
    if row["gap"] <= 0:
        return f"{text}, but this driver does not earn more by it."
    return f"{text}."


def induced_in_several(persona: str, responders: Sequence[Row], unit: str) -> str:
    """The same as means over several pairs; `unit` is what they are called. Empty without any."""
    if not responders:
        return ""
    rates = [row["ego_failure_rate_best_response"] for row in responders]
    before = sum(row["ego_failure_rate"] for row in responders) / len(rates)
    text = f"{_responding(persona, *responders)} {percent(sum(rates) / len(rates))} of games "
    return f"{text}(mean of {len(rates)} {unit}: {interval(min(rates), max(rates))}) instead of {percent(before)}."


def _responding(persona: str, *rows: Row) -> str:
    """The persona with its best known responses of these rows."""
    if any(_known(row) for row in rows):
        return f"A {persona} driver with its best known response makes this ego fail in"
    return f"A {persona} driver newly trained against this ego makes it fail in"


def _side(player: str, row: Row | None) -> str:
    if row is None:
        return f"no best response of {player} was trained"
    match GapVerdict(row["verdict"]):
        case GapVerdict.DISTINGUISHABLE:
            return f"{player} could still gain {_share(row)} of its payoff{_by_playing(row)}"
        case GapVerdict.BEFORE_HOLM_ONLY:
            holm = f"but not after Holm's correction ({p_text(row['p_holm'])})"
            return f"{player} might gain {_share(row)} of its payoff{_by_playing(row)}, {holm}"
        case GapVerdict.NOT_DISTINGUISHABLE:
            measured = f"after {_budget(row)} a gain of {_share(row)}{_by_playing(row)} was measured for {player}"
            return f"{measured}, which is not distinguishable from 0{_span(row)}"
        case GapVerdict.NONE_FOUND:
            return _nothing_better(player, row)
        case GapVerdict.LACKS_POWER:
            below = f"{_budget(row)} end {_below(row)} its own strategy"
            return f"the search for {player} lacks power: {below}"
        case GapVerdict.NO_DIFFERENCE:
            return f"the best response of {player} earns the same in every game"
        case GapVerdict.ALL_EQUAL:
            gain = f"{_share(row)} of its payoff{_by_playing(row)}"
            return f"{player} gains {gain}, the same in every game: there is no test"
        case _:
            return f"for {player} too few games could be compared"


def _budget(row: Row) -> str:
    """What the search had, e.g. "600,000 steps from 2 starts"."""
    return f"{number(row['search_steps'], 0)} steps from {counted(row['search_starts'], 'start')}"


def _known(row: Row) -> list[str]:
    """The other strategies that were taken as best response, beside the search or in its place."""
    return [name for name in row["best_known"].split(" + ") if name not in ("", OWN, SEARCH)]


def _by_playing(row: Row) -> str:
    """The known strategies by which the gain was measured; empty where the search alone found it."""
    names = _known(row)
    if names and SEARCH in row["best_known"].split(" + "):
        names = ["the newly trained strategy", *names]
    return f" by playing {' or '.join(names)}" if names else ""


def _nothing_better(player: str, row: Row) -> str:
    known = row["known"]
    others = f"{known} other {'strategy' if known == 1 else 'strategies'}"
    if row["search_gap"] > 0:  # the search alone earned more: what was taken in the halves of the games did not
        choice = f"the best of {_budget(row)} and {others} of this campaign"
        return f"for {player} {choice} earns no more in games that did not choose it"
    nor = f", nor {'does' if known == 1 else 'do'} {others} of this campaign earn more" if known else ""
    return f"{_budget(row)} found nothing better for {player}{nor}"


def _below(row: Row) -> str:
    """How far below the player's own strategy the search ended."""
    if row["payoff"]:
        below = signed(row["search_gap"] / abs(row["payoff"]) * 100, 1).lstrip(MINUS)
        return f"{below}{NO_SPACE}% below"
    return f"{number(-row['search_gap'], 2)} below the 0 of"


def _share(row: Row) -> str:
    """The gap as a share of the payoff; where the payoff is 0, the gap itself."""
    if math.isfinite(row["gap_share"]):
        return percent(row["gap_share"])
    return f"{number(row['gap'], 2)} above the 0"


def _span(row: Row) -> str:
    """The gap's interval as shares of the payoff; empty where there is none."""
    if not (row["payoff"] and math.isfinite(row["ci_low"])):
        return ""
    low, high = (signed(row[end] / abs(row["payoff"]) * 100, 1) for end in ("ci_low", "ci_high"))
    return f" ({SURE}: {low} to {high}{NO_SPACE}%)"
