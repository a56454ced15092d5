"""A policy saved by Stable-Baselines3 or sb3-contrib as a driver.

The part `data` of such a file is JSON. Which algorithm saved the file is read from its keys, so that the file decides
and not the name that a document gives it. Reading the policy itself may run any code (`drivers.external`).
"""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from harness.config.driver import StableBaselines3
from harness.drivers.policy_file import ACTIONS
from harness.errors import UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation_layout import SIZE

_CONTRIB = ("TQC", "RecurrentPPO")
"""The algorithms of the package sb3-contrib."""
_SAC_LIKE = ("SAC", "TQC")
"""A normal distribution of actions, squashed by tanh."""
_DETERMINISTIC = ("TD3", "DDPG", "DQN")
_ALIKE = ({"PPO", "A2C"}, {"TD3", "DDPG"})
"""Algorithms whose policies are of the same class: a file of one drives as a file of the other."""
_SIGNS: tuple[tuple[str, frozenset[str]], ...] = (
    ("TQC", frozenset({"top_quantiles_to_drop_per_net"})),
    ("TRPO", frozenset({"cg_max_steps"})),
    ("CrossQ", frozenset({"target_entropy", "policy_delay"})),
    ("SAC", frozenset({"target_entropy", "tau"})),
    ("TD3", frozenset({"target_policy_noise"})),
    ("DQN", frozenset({"exploration_fraction"})),
    ("ARS", frozenset({"n_delta"})),
    ("PPO", frozenset({"clip_range", "n_epochs", "vf_coef"})),
    ("A2C", frozenset({"vf_coef", "ent_coef"})),
)
"""Keys of `data` by which the algorithm is known; the first row whose keys are all there counts."""
_FAMILIES = {
    "sb3_contrib.common.recurrent": "RecurrentPPO",
    "sb3_contrib.common.maskable": "MaskablePPO",
    "sb3_contrib.qrdqn": "QRDQN",
}
"""Algorithms with the keys of another one, by a part of the module of their policies."""


class Sb3Driver:
    """Drives by a policy of Stable-Baselines3: by its most likely action, or by a sample of its distribution. The state
    of a recurrent policy is kept per game."""

    takes_over = True

    def __init__(self, document: StableBaselines3, file: Path, sampled: bool, normalize: Path | None = None) -> None:
        """Read the policy. Raises UsageError as `read_sb3_policy` does, and if `sampled` is true for a policy without a
        distribution to sample."""
        self._policy, self._scaling, self._gives_index = read_sb3_policy(document, file, normalize)
        deterministic = document.algorithm in _DETERMINISTIC
        if sampled and (deterministic or self._gives_index or getattr(self._policy, "use_sde", False)):
            what = f"{document.algorithm}'s policies are deterministic" if deterministic else "gSDE draws its own noise"
            what = "the noise samples no discrete actions" if self._gives_index and not deterministic else what
            remedy = 'give the ego a persona with decisions = "mode"'
            raise UsageError.of(file, "", f"the ego's persona samples its decisions, but {what}", remedy)
        self._sampled, self._squashed = sampled, document.algorithm in _SAC_LIKE
        self._actions = np.array(document.actions, dtype=np.float64)
        self._memory = _Memory(self._policy) if document.algorithm == "RecurrentPPO" else None

    def reset(self, games: IntArray) -> None:
        """Reset games [N]: a recurrent policy forgets them; the decisions of others depend on the observation only."""
        if self._memory is not None:
            self._memory.forget(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used if decisions are sampled."""
        inputs = np.asarray(observation, dtype=np.float32)
        if self._scaling is not None:
            inputs = np.asarray(self._scaling.normalize_obs(inputs), dtype=np.float32)
        if not self._sampled:
            action = self._most_likely(games, inputs)
            if self._gives_index:
                return self._actions[np.asarray(action, dtype=np.int64)]
            return np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        mean, deviation = self._distribution(games, inputs)
        action = mean + deviation * noise
        return np.tanh(action) if self._squashed else np.clip(action, -1.0, 1.0)

    def _most_likely(self, games: IntArray, inputs: FloatArray) -> Any:
        if self._memory is None:
            return self._policy.predict(inputs, deterministic=True)[0]
        state, starts = self._memory.recall(games)
        action, state = self._policy.predict(inputs, state=state, episode_start=starts, deterministic=True)
        self._memory.keep(games, state)
        return action

    def _distribution(self, games: IntArray, inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and deviation [N, 2] of the normal distribution of actions; for SAC before the squashing."""
        import torch

        with torch.no_grad():
            seen = torch.from_numpy(inputs)
            if self._squashed:
                mean, log_deviation, _ = self._policy.actor.get_action_dist_params(seen)
                return mean.double().numpy(), log_deviation.double().exp().numpy()
            if self._memory is None:
                normal = self._policy.get_distribution(seen).distribution
            else:
                state, starts = self._memory.recall(games)
                tensors = tuple(torch.from_numpy(each) for each in state)
                found, new = self._policy.get_distribution(seen, tensors, torch.from_numpy(starts).float())
                self._memory.keep(games, tuple(each.numpy() for each in new))
                normal = found.distribution
            return normal.mean.double().numpy(), normal.stddev.double().numpy()


class _Memory:
    """The state of a recurrent policy in each game: hidden and cell, [layers, units]."""

    def __init__(self, policy: Any) -> None:
        layers, units = policy.lstm_hidden_state_shape[0], policy.lstm_hidden_state_shape[2]
        self._blank = np.zeros((2, layers, units), dtype=np.float32)
        self._of: dict[int, FloatArray] = {}

    def forget(self, games: IntArray) -> None:
        for game in games.tolist():
            self._of.pop(game, None)

    def recall(self, games: IntArray) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
        """Hidden and cell [layers, N, units], and which games [N] begin."""
        both = np.stack([self._of.get(game, self._blank) for game in games.tolist()], axis=2)
        starts = np.array([game not in self._of for game in games.tolist()])
        return (both[0], both[1]), starts

    def keep(self, games: IntArray, state: tuple[FloatArray, FloatArray]) -> None:
        both = np.stack(state)
        for place, game in enumerate(games.tolist()):
            self._of[game] = both[:, :, place].copy()


class SavedPolicy(NamedTuple):
    """A policy, and what it needs beside the observation."""

    policy: Any
    scaling: Any
    """The `VecNormalize` of its training; None: it sees observations as they are."""
    gives_index: bool
    """Whether it decides the index of an action instead of an action."""


def read_sb3_policy(document: StableBaselines3, file: Path, normalize: Path | None) -> SavedPolicy:
    """The policy in a file. Raises UsageError if it can't be read, if another algorithm saved it, if its spaces are not
    those of a driver, and if it learned under `VecNormalize` and `normalize` is not given."""
    saved, named = saved_by(file), document.algorithm
    if saved not in (None, named) and {saved, named} not in _ALIKE:
        known = StableBaselines3.model_fields["algorithm"].annotation.__args__  # type: ignore[union-attr]
        remedy = f'algorithm = "{saved}"' if saved in known else f"policies of {saved} are not supported"
        raise UsageError.of(file, "algorithm", f"{saved} saved this file, not {named}", remedy)
    model = _load(named, file)
    if named != "RecurrentPPO" and hasattr(model.policy, "lstm_actor"):
        message = f"its policy is recurrent, which no policy of {named} is"
        raise UsageError.of(file, "algorithm", message, 'algorithm = "RecurrentPPO"')
    gives_index = _check_spaces(document, file, model)
    scaling = _read_scaling(normalize) if normalize is not None else None
    if scaling is None and _learned_under_scaling(model):
        message = "it learned under VecNormalize, whose file says whether and how observations were scaled"
        remedy = 'name what VecNormalize.save wrote, with norm_obs=False too: normalize = "vn.pkl"'
        raise UsageError.of(file, "normalize", message, remedy)
    return SavedPolicy(model.policy, scaling, gives_index)


def saved_by(file: Path) -> str | None:
    """The algorithm that saved a file, by its `data`; None if this is not known. Nothing is unpickled."""
    try:
        with zipfile.ZipFile(file) as archive:
            data = json.loads(archive.read("data"))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return None
    if not isinstance(data, dict):
        return None
    policy_class = data.get("policy_class")
    module = str(policy_class.get("__module__", "")) if isinstance(policy_class, Mapping) else ""
    families = [name for part, name in _FAMILIES.items() if part in module]
    return next(iter([*families, *(name for name, keys in _SIGNS if keys <= data.keys())]), None)


def _learned_under_scaling(model: Any) -> bool:
    """Whether a model learned under `VecNormalize`: its last observation is out of the bounds of its observation space,
    or it kept the unscaled one beside it. (Algorithms with a replay buffer always keep two.) With `norm_obs=False` only
    rewards were scaled, which nothing in the model's file tells."""
    last = getattr(model, "_last_obs", None)
    if not hasattr(model, "replay_buffer_class") and getattr(model, "_last_original_obs", None) is not None:
        return True
    return isinstance(last, np.ndarray) and bool(np.abs(last).max(initial=0.0) > 1.0)


def _load(algorithm: str, file: Path) -> Any:
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    package: Any = stable_baselines3
    if algorithm in _CONTRIB:
        try:
            import sb3_contrib as package
        except ImportError:
            message = f"{algorithm} needs sb3-contrib, which is not installed"
            raise UsageError.of(file, "", message, "pip install 'safedriverl-harness[sb3]'") from None
    # Replaced because only training needs them: a buffer of a million steps, and schedules that are pickled functions,
    # which another version of Python may be unable to read.
    replaced = {"buffer_size": 1, "learning_rate": 0.0, "lr_schedule": _zero, "clip_range": _zero}
    if algorithm == "DQN":
        replaced["exploration_schedule"] = _zero
    try:
        return getattr(package, algorithm).load(file, device="cpu", custom_objects=replaced)
    except Exception as error:  # zipfile, pickle, torch and unpickled classes may raise any exception
        remedy = "is the algorithm right, and are the classes it was saved with installed?"
        raise _unreadable(file, f"a policy of {algorithm}", error, remedy) from None


def _check_spaces(document: StableBaselines3, file: Path, model: Any) -> bool:
    """Whether the actions are indices of the document's `actions`. Raises UsageError for other spaces."""
    listed, count = len(document.actions), getattr(model.action_space, "n", None)
    if count is None and listed:
        message, remedy = "its actions are not discrete: this table would be ignored", "leave it out"
        raise UsageError.of(file, "actions", message, remedy)
    if count is not None and listed != count:
        message = f"its actions are discrete, 0 to {count - 1}, and the document has {listed} `actions`"
        remedy = f"list the pedals and the wheel of each in the document: actions = [[0.5, 0.0], …], {count} pairs"
        raise UsageError.of(file, "actions", message, remedy)
    for name, size in (("observation", SIZE), *([("action", ACTIONS)] if count is None else [])):
        space = getattr(model, f"{name}_space", None)
        low, high = getattr(space, "low", np.nan), getattr(space, "high", np.nan)
        if getattr(space, "shape", None) != (size,) or not (np.allclose(low, -1.0) and np.allclose(high, 1.0)):
            message = f"its {name} space is {space}, not Box(-1.0, 1.0, ({size},), float32)"
            raise UsageError.of(file, f"{name}_space", message, "train it on harness/Ego-v0")
    return count is not None


def _read_scaling(file: Path) -> Any:
    """What `VecNormalize.save` wrote. It is a pickle: the permission to read the policy is one to read this too."""
    from stable_baselines3.common.vec_env import VecNormalize

    try:
        with file.open("rb") as stream:
            scaling = pickle.load(stream)
        if not isinstance(scaling, VecNormalize):
            raise TypeError(f"it holds a {type(scaling).__name__}, not a VecNormalize")
        seen = np.asarray(scaling.normalize_obs(np.zeros((1, SIZE), dtype=np.float32)))
        if seen.shape != (1, SIZE) or not np.isfinite(seen).all():
            raise ValueError(f"it makes observations {seen.shape} of {(1, SIZE)}")
    except Exception as error:  # an unpickled class may raise any exception
        raise _unreadable(file, "a VecNormalize", error, "save it anew with VecNormalize.save") from None
    return scaling


def _unreadable(file: Path, what: str, error: Exception, remedy: str) -> UsageError:
    message = f"can't be read as {what}: {type(error).__name__}: {error}"
    return UsageError.of(file, "", " ".join(message.split())[:500], remedy)


def _zero(_: float) -> float:
    return 0.0
