"""A policy saved by Stable-Baselines3 as a driver. Such a file may contain pickles: reading it may run any code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from harness.config.driver import StableBaselines3
from harness.drivers.policy_file import ACTIONS
from harness.errors import UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation_layout import SIZE


class Sb3Driver:
    """Drives by a policy of PPO, A2C, SAC or TD3: by its most likely action, or by a sample of its distribution."""

    takes_over = True

    def __init__(self, document: StableBaselines3, file: Path, sampled: bool) -> None:
        """Read the policy. Raises UsageError if it can't be read, if its spaces are not those of a driver, or if
        `sampled` is true for a policy without a distribution to sample."""
        self._policy = _read(document, file)
        if sampled and (document.algorithm == "TD3" or getattr(self._policy, "use_sde", False)):
            what = "TD3's policies are deterministic" if document.algorithm == "TD3" else "gSDE draws its own noise"
            remedy = 'give the ego a persona with decisions = "mode"'
            raise UsageError.of(file, "", f"the ego's persona samples its decisions, but {what}", remedy)
        self._sampled, self._squashed = sampled, document.algorithm == "SAC"

    def reset(self, games: IntArray) -> None:
        """Do nothing: each decision depends on the current observation only."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used if decisions are sampled."""
        import torch

        inputs = np.asarray(observation, dtype=np.float32)
        if not self._sampled:
            action, _ = self._policy.predict(inputs, deterministic=True)
            return np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        with torch.no_grad():
            mean, deviation = self._distribution(torch.from_numpy(inputs))
        action = mean + deviation * noise
        return np.tanh(action) if self._squashed else np.clip(action, -1.0, 1.0)

    def _distribution(self, inputs: Any) -> tuple[FloatArray, FloatArray]:
        """Mean and deviation [N, 2] of the normal distribution of actions; for SAC before the squashing."""
        if self._squashed:
            mean, log_deviation, _ = self._policy.actor.get_action_dist_params(inputs)
            return mean.double().numpy(), log_deviation.double().exp().numpy()
        normal = self._policy.get_distribution(inputs).distribution
        return normal.mean.double().numpy(), normal.stddev.double().numpy()


def _read(document: StableBaselines3, file: Path) -> Any:
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    algorithm = getattr(stable_baselines3, document.algorithm)
    # Replaced because only training needs them: a buffer of a million steps, and schedules that are pickled functions,
    # which another version of Python may be unable to read.
    replaced = {"buffer_size": 1, "learning_rate": 0.0, "lr_schedule": _zero, "clip_range": _zero}
    try:
        model = algorithm.load(file, device="cpu", custom_objects=replaced)
    except Exception as error:  # zipfile, pickle, torch and unpickled classes may raise any exception
        remedy = "is the algorithm right, and are the classes it was saved with installed?"
        what = f"can't be read as a policy of {document.algorithm}: {type(error).__name__}: {error}"
        raise UsageError.of(file, "", " ".join(what.split())[:500], remedy) from None
    for name, size in (("observation", SIZE), ("action", ACTIONS)):
        space = getattr(model, f"{name}_space", None)
        bounds = getattr(space, "low", None), getattr(space, "high", None)
        fits = getattr(space, "shape", None) == (size,) and all(
            bound is not None and np.allclose(bound, end) for bound, end in zip(bounds, (-1.0, 1.0), strict=True)
        )
        if not fits:
            message = f"its {name} space is {space}, not Box(-1.0, 1.0, ({size},), float32)"
            raise UsageError.of(file, f"{name}_space", message, "train it on harness/Ego-v0")
    return model.policy


def _zero(_: float) -> float:
    return 0.0
