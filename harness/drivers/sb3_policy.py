"""A policy that Stable-Baselines3 saved as a driver. Such files may hold pickles: reading one may run any code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from harness.config.driver import StableBaselines3
from harness.drivers.policy_file import ACTIONS
from harness.errors import UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation import SIZE


class Sb3Driver:
    """Drives by a policy of PPO, A2C, SAC or TD3: by its most likely action, or varied as the policy itself varies."""

    takes_over = True

    def __init__(self, document: StableBaselines3, file: Path, sampled: bool) -> None:
        """Read the policy. Raises UsageError where it can't be read, or doesn't fit what a driver sees and does."""
        self._policy = _read(document, file)
        if sampled and (document.algorithm == "TD3" or getattr(self._policy, "use_sde", False)):
            what = "TD3's policies don't vary" if document.algorithm == "TD3" else "gSDE varies by noise of its own"
            remedy = 'give the ego a persona with decisions = "mode"'
            raise UsageError.of(file, "", f"the ego's persona decides by sampling, but {what}", remedy)
        self._sampled, self._squashed = sampled, document.algorithm == "SAC"

    def reset(self, games: IntArray) -> None:
        """Nothing to forget: each decision is made from what is seen at that moment."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used where decisions vary."""
        import torch

        seen = np.asarray(observation, dtype=np.float32)
        if not self._sampled:
            action, _ = self._policy.predict(seen, deterministic=True)
            return np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        with torch.no_grad():
            likeliest, deviation = self._distribution(torch.from_numpy(seen))
        action = likeliest + deviation * noise
        return np.tanh(action) if self._squashed else np.clip(action, -1.0, 1.0)

    def _distribution(self, seen: Any) -> tuple[FloatArray, FloatArray]:
        """Mean and deviation [N, 2] of the normal distribution of actions; SAC's before they are squashed."""
        if self._squashed:
            mean, log_deviation, _ = self._policy.actor.get_action_dist_params(seen)
            return mean.double().numpy(), log_deviation.double().exp().numpy()
        normal = self._policy.get_distribution(seen).distribution
        return normal.mean.double().numpy(), normal.stddev.double().numpy()


def _read(document: StableBaselines3, file: Path) -> Any:
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    algorithm = getattr(stable_baselines3, document.algorithm)
    # what only a learner needs: room for a million steps, and schedules that another Python may not be able to read
    spared = {"buffer_size": 1, "learning_rate": 0.0, "lr_schedule": _nothing, "clip_range": _nothing}
    try:
        model = algorithm.load(file, device="cpu", custom_objects=spared)
    except Exception as error:  # whatever zipfile, pickle, torch or the author's own classes raise
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


def _nothing(_: float) -> float:
    return 0.0
