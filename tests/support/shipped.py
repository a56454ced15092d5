"""The shipped policies and their demonstration by name, and a campaign of shipped things alone, as a user writes it."""

from __future__ import annotations

from harness.campaign.shipped_people import people_of
from tests.support.repository import REPOSITORY

FOLDER = "paper_merge"  # of the shipped policies; their scene and their campaign have the same name
SEED = 11
SPEEDY, DISTRACTED = "paper_speedy", "paper_distracted"
PERSONAS = (SPEEDY, DISTRACTED)
POLICIES = REPOSITORY / "policies" / FOLDER
CAMPAIGNS = REPOSITORY / "campaigns"
CAMPAIGN, DEMO = CAMPAIGNS / f"{FOLDER}.toml", CAMPAIGNS / "demo.toml"


def stage(name: str) -> str:
    """A stage of the shipped policies' training seed."""
    return f"{name}-seed{SEED}"


def people_seeds(scene: str) -> list[int]:
    """The training seeds of the shipped people of a scene."""
    return sorted({seed for people in people_of(REPOSITORY / "networks" / scene) for seed in people.seeds})


NAIVE, PERSON, RETRAINED = stage("naive"), stage(SPEEDY), stage(f"retrained_{SPEEDY}")
NAIVE_BY_NAME, PERSON_BY_NAME = f"{FOLDER}/{NAIVE}", f"{FOLDER}/{PERSON}"  # as a campaign names them
ALL = {NAIVE, *(stage(f"{prefix}{name}") for prefix in ("", "retrained_") for name in PERSONAS)}

TWO_GAMES = f"""
name = "two_games"
scene = "{FOLDER}"
personas = ["{SPEEDY}"]
seeds = [{SEED}]
policies = "{FOLDER}"
[ego]
persona = "careful"
[assessment]
episodes = 2
reference_drivers = false
"""
