"""What is said of a best-response gap."""

from __future__ import annotations

from enum import Enum


class GapVerdict(str, Enum):
    """Every value the column `verdict` can have."""

    DISTINGUISHABLE = "distinguishable from 0"
    """p_holm < significance: this player could gain."""
    BEFORE_HOLM_ONLY = "distinguishable from 0 before Holm's correction only"
    NOT_DISTINGUISHABLE = "not distinguishable from 0"
    """The best known response earned more, but not significantly."""
    NONE_FOUND = "no better response found"
    """Nothing earned more than the player's own strategy, or not in games that did not choose it."""
    LACKS_POWER = "the search lacks power: it ends below the player's own strategy"
    """No gain is distinguishable from 0, and what the search trained earned less than the player: its interval is below
    0, or it earned less by the same number in every game. That such a search finds nothing better shows nothing."""
    NO_DIFFERENCE = "no difference"
    """Every game has the same payoff with and without what the search trained, and nothing else earned more."""
    ALL_EQUAL = "no t statistic: all differences equal"
    """The best response earned more by the same number in every game."""
    NOT_ENOUGH_PAIRS = "not enough pairs"
    NOT_ANSWERED = "not answered: the pair was not shown to drive this scene"
    """A player of the pair misses a bound of `Response.alone`, so there is no test."""
