"""Training a policy with PPO, and searching the parameters of a driver that is not trained."""
