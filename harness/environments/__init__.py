"""Games of an opened scene: what steps them, and the environments of Gymnasium, PettingZoo and Stable-Baselines3.

Its import registers `harness/Ego-v0` and `harness/NonEgo-v0` with Gymnasium.
"""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

for _name, _player in (("harness/Ego-v0", "ego"), ("harness/NonEgo-v0", "non_ego")):
    if _name not in registry:
        register(
            _name,
            entry_point="harness.environments.gymnasium_env:DrivingEnv",
            vector_entry_point="harness.environments.gymnasium_vector:VectorDrivingEnv",
            kwargs={"player": _player},
        )
