"""A campaign of shipped things alone, as a user of the package writes it."""

from __future__ import annotations

TWO_GAMES = """
name = "two_games"
scene = "merge"
personas = ["speedy"]
policies = "merge"
[ego]
persona = "careful"
[assessment]
episodes = 2
reference_drivers = false
"""
