"""Files of Stable-Baselines3 and sb3-contrib: which algorithm saved one, and the policy in it.

The part `data` of such a file is JSON. Which algorithm saved the file is read from its keys, so that the file decides
and not the name that a document gives it. Reading the policy itself may run any code (`drivers.external`).
"""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from harness.config.driver import StableBaselines3
from harness.drivers.policy_file import ACTIONS
from harness.errors import UsageError
from harness.game.observation_layout import SIZE

CONTRIB = ("TQC", "RecurrentPPO")
"""The algorithms of the package sb3-contrib."""
SAC_LIKE = ("SAC", "TQC")
"""A normal distribution of actions, squashed by tanh."""
DETERMINISTIC = ("TD3", "DDPG", "DQN")
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


class SavedPolicy(NamedTuple):
    """A policy, and what it needs beside the observation."""

    policy: Any
    scaling: Any
    """The `VecNormalize` of its training; None: it sees observations as they are."""
    gives_index: bool
    """Whether it decides the index of an action instead of an action."""


def read_sb3_policy(document: StableBaselines3, file: Path, normalize: Path | None) -> SavedPolicy:
    """The policy in a file. Raises UsageError if it can't be read, if another algorithm saved it, if its spaces are not
    those of a driver, and if it learned from normalised observations and `normalize` is not given."""
    _check_algorithm(document, file)
    model = _load(document, file)
    if document.algorithm != "RecurrentPPO" and hasattr(model.policy, "lstm_actor"):
        message = f"its policy is recurrent, which no policy of {document.algorithm} is"
        raise UsageError.of(file, "algorithm", message, 'algorithm = "RecurrentPPO"')
    gives_index = _check_spaces(document, file, model)
    scaling = _read_scaling(normalize) if normalize is not None else None
    if scaling is None and learned_normalised(model):
        message = "it learned from observations that VecNormalize scaled, so that it can't drive by others"
        remedy = 'name the file that VecNormalize.save wrote: normalize = "vn.pkl"'
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


def learned_normalised(model: Any) -> bool:
    """Whether a model learned from observations that `VecNormalize` scaled: its last one is out of the bounds of its
    observation space, or it kept the unscaled one beside it. (Algorithms with a replay buffer always keep two.)"""
    last = getattr(model, "_last_obs", None)
    on_policy = not hasattr(model, "replay_buffer_class")
    if on_policy and getattr(model, "_last_original_obs", None) is not None:
        return True
    return isinstance(last, np.ndarray) and bool(np.abs(last).max(initial=0.0) > 1.0)


def _check_algorithm(document: StableBaselines3, file: Path) -> None:
    saved, named = saved_by(file), document.algorithm
    if saved is None or saved == named or {saved, named} in _ALIKE:
        return
    known = StableBaselines3.model_fields["algorithm"].annotation.__args__  # type: ignore[union-attr]
    remedy = f'algorithm = "{saved}"' if saved in known else f"policies of {saved} are not supported"
    raise UsageError.of(file, "algorithm", f"{saved} saved this file, not {named}", remedy)


def _load(document: StableBaselines3, file: Path) -> Any:
    import stable_baselines3
    import torch

    torch.set_num_threads(1)
    if document.algorithm in CONTRIB:
        try:
            import sb3_contrib
        except ImportError:
            message = f"{document.algorithm} needs sb3-contrib, which is not installed"
            raise UsageError.of(file, "", message, "pip install 'safedriverl-harness[sb3]'") from None
        algorithm = getattr(sb3_contrib, document.algorithm)
    else:
        algorithm = getattr(stable_baselines3, document.algorithm)
    # Replaced because only training needs them: a buffer of a million steps, and schedules that are pickled functions,
    # which another version of Python may be unable to read.
    replaced = {"buffer_size": 1, "learning_rate": 0.0, "lr_schedule": _zero, "clip_range": _zero}
    if document.algorithm == "DQN":
        replaced["exploration_schedule"] = _zero
    try:
        return algorithm.load(file, device="cpu", custom_objects=replaced)
    except Exception as error:  # zipfile, pickle, torch and unpickled classes may raise any exception
        remedy = "is the algorithm right, and are the classes it was saved with installed?"
        what = f"can't be read as a policy of {document.algorithm}: {type(error).__name__}: {error}"
        raise UsageError.of(file, "", " ".join(what.split())[:500], remedy) from None


def _check_spaces(document: StableBaselines3, file: Path, model: Any) -> bool:
    """Whether the actions are indices of the document's `actions`. Raises UsageError for other spaces."""
    count = getattr(model.action_space, "n", None)
    if gives_index := count is not None:
        _check_actions(document.actions, int(count), file)
    elif document.actions:
        message, remedy = "its actions are not discrete: this table would be ignored", "leave it out"
        raise UsageError.of(file, "actions", message, remedy)
    for name, size in (("observation", SIZE), *([] if gives_index else [("action", ACTIONS)])):
        space = getattr(model, f"{name}_space", None)
        bounds = getattr(space, "low", None), getattr(space, "high", None)
        fits = getattr(space, "shape", None) == (size,) and all(
            bound is not None and np.allclose(bound, end) for bound, end in zip(bounds, (-1.0, 1.0), strict=True)
        )
        if not fits:
            message = f"its {name} space is {space}, not Box(-1.0, 1.0, ({size},), float32)"
            raise UsageError.of(file, f"{name}_space", message, "train it on harness/Ego-v0")
    return gives_index


def _check_actions(actions: Sequence[object], count: int, file: Path) -> None:
    if len(actions) != count:
        message = f"its actions are discrete, 0 to {count - 1}, and the document has {len(actions)} `actions`"
        remedy = f"list the pedals and the wheel of each in the document: actions = [[0.5, 0.0], …], {count} pairs"
        raise UsageError.of(file, "actions", message, remedy)


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
        what = f"can't be read as a VecNormalize: {type(error).__name__}: {error}"
        remedy = "save it anew with VecNormalize.save"
        raise UsageError.of(file, "", " ".join(what.split())[:500], remedy) from None
    return scaling


def _zero(_: float) -> float:
    return 0.0
