"""From recorded games to numbers and verdicts: metrics, comparisons, manoeuvres, game theory. No SUMO, no torch."""
