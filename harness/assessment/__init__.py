"""Judging by games: seeded rollouts, recorded courses, conflicts replayed, checks of drivers."""
