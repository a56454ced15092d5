"""Learning a policy with PPO, and searching the parameters of a driver that does not learn."""
