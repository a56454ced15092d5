"""Manoeuvres of the players in a recorded game, named by stated rules, and the pair that led to a failure."""

from harness.evaluation.manoeuvres.naming import NAMES, Manoeuvre, find_manoeuvres, manoeuvres_in, rows_of
from harness.evaluation.manoeuvres.pairs import NO_CAUSE, NO_REACTION, Pair, pair_of, pairs_in

__all__ = [
    "NAMES",
    "NO_CAUSE",
    "NO_REACTION",
    "Manoeuvre",
    "Pair",
    "find_manoeuvres",
    "manoeuvres_in",
    "pair_of",
    "pairs_in",
    "rows_of",
]
