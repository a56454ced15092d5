"""What the players of a recorded game did, named by stated rules, and which of it led to a failure."""

from harness.evaluation.manoeuvres.naming import NAMES, Manoeuvre, find_manoeuvres, manoeuvres_in, rows_of
from harness.evaluation.manoeuvres.pairs import Pair, pair_of, pairs_in

__all__ = ["NAMES", "Manoeuvre", "Pair", "find_manoeuvres", "manoeuvres_in", "pair_of", "pairs_in", "rows_of"]
