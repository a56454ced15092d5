"""Comparing arms, training seeds and runs: intervals, tests, and the bounds of [acceptance]."""
