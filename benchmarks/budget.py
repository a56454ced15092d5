"""How long the measurements take: in full for figures that count, in a minute or two to see that everything works."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Budget:
    """The lengths and repeats of all measurements."""

    lap_s: float
    """Length of one turn of one side of a ratio."""
    repeats: int
    """Turns of each side."""
    training_lap_s: float
    """The same where the sides train."""
    traffic_steps: int
    """Steps of an arena among background traffic, from the same start each time."""
    traffic_repeats: int
    campaign_share: float
    """Share of each training of the campaign that is carried out."""
    memory_warm_up_steps: int
    memory_steps: int
    episodes: int
    """Episodes of each arm of that campaign."""
    ray_steps: int
    """Steps of each training of the campaign that is carried out on Ray and without."""
    ray_episodes: int
    arms: int
    """How often an arm of 100 episodes is played, after a first time that does not count."""
    starts: int
    """How often a command is started, after a first time that does not count."""
    seeds: int
    """Training seeds of the campaign with many arms."""
    personas: int
    """Its personas, with four arms each for every seed, beside two of the naive ego."""


FULL = Budget(
    lap_s=1.0,
    repeats=11,
    training_lap_s=4.0,
    traffic_steps=100,
    traffic_repeats=7,
    campaign_share=0.1,
    memory_warm_up_steps=262_144,
    memory_steps=1_000_000,
    episodes=100,
    ray_steps=131_072,
    ray_episodes=30,
    arms=3,
    starts=9,
    seeds=3,
    personas=8,
)
FAST = Budget(
    lap_s=0.3,
    repeats=3,
    training_lap_s=0.5,
    traffic_steps=20,
    traffic_repeats=2,
    campaign_share=0.005,
    memory_warm_up_steps=8_192,
    memory_steps=32_768,
    episodes=5,
    ray_steps=8_192,
    ray_episodes=2,
    arms=1,
    starts=3,
    seeds=1,
    personas=2,
)
