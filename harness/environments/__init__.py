"""The stepping loop and its interfaces: Gymnasium, PettingZoo, Stable-Baselines3, and seeded rollouts."""
