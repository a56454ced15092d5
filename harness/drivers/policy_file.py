"""A learned policy on disk and as a driver: parameters as safetensors, metadata as JSON. Opening a policy runs no code,
and driving by one needs no framework.

<name>/policy.safetensors    actor.<k>.weight [out, in], actor.<k>.bias [out], log_deviation [2]; critic likewise
<name>/policy.json           format, description of the training, names of the observation's entries
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from harness.config.persona import Persona
from harness.config.scene import Share
from harness.config.toml_reading import Excerpt, nearest
from harness.config.traits import NO_TRAIT
from harness.errors import UsageError
from harness.files import content_of, make_folder, write_atomically
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation_layout import LAYOUT

FORMAT = 1
ACTIONS = 2
ARCHIVES = (".zip", ".pkl", ".pickle", ".pt", ".pth", ".ckpt", ".joblib", ".npy", ".npz", ".onnx")
_MAX_TENSOR_BYTES, _MAX_CARD_BYTES = 100_000_000, 1_000_000
_MAX_PARAMETER = 1e6  # a larger parameter is a sign of damage
_LAYER = re.compile(r"(actor|critic)\.(\d{1,2})\.", re.ASCII)
_POLICY_FOLDER = "name the folder of a policy, as under <run>/policies/"
_Text = Annotated[str, Field(max_length=200)]
_Stages = Annotated[str, Field(max_length=1000)]


class PolicyCard(Excerpt):
    """What `policy.json` says about how a policy learned; None: it does not say."""

    player: Literal["ego", "non_ego"] | None = None
    persona: _Text | None = None
    persona_sha256: _Text | None = None
    scene: _Text | None = None
    roads: tuple[_Text, ...] = ()
    """Further scenes on which it learned."""
    step_s: float | None = None
    friction: tuple[float, float] | None = None
    """The range of the games' coefficients of friction."""
    cars: tuple[dict[_Text, float], ...] = ()
    """The limits of the actuators of each car that it drove; empty: it does not say."""
    against: _Stages | None = None
    selected: _Stages | None = None
    """The training whose policy a selection chose."""
    began_from: _Stages | None = None
    learned_in: _Stages | None = None
    """The training of several personas from which it is derived."""
    learned_with: Annotated[tuple[_Text, ...], Field(max_length=50)] = ()
    alone_share: Share | None = None
    """The share of its games without the opponent."""
    attentive_share: Share | None = None
    """The share of its budget without lapses of attention."""
    training: dict[str, bool | int | float | str | list[int] | None] | None = None
    """Its settings."""


@dataclass(frozen=True)
class Policy:
    """Actor and critic as arrays: layers with tanh between them, and the log standard deviation of the actions [2].

    >>> import harness
    >>> policy = harness.read_policy("policies/paper_merge/naive-seed11")
    >>> [weight.shape[1] for weight, bias in policy.layers("actor")][0]
    98
    """

    tensors: Mapping[str, FloatArray]
    card: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        """The names of the arrays and their shapes, without the thousands of numbers."""
        shapes = ", ".join(f"{name} {list(self.tensors[name].shape)}" for name in sorted(self.tensors))
        return f"Policy({self.card.get('stage', 'without a card')}: {shapes})"

    def layers(self, part: str) -> list[tuple[FloatArray, FloatArray]]:
        """Weights [out, in] and biases [out] of `actor` or `critic`, in order."""
        count = sum(name.startswith(f"{part}.") and name.endswith(".weight") for name in self.tensors)
        return [(self.tensors[f"{part}.{k}.weight"], self.tensors[f"{part}.{k}.bias"]) for k in range(count)]


class LearnedDriver:
    """Drives by a policy: by its most likely action, or by a sample of its distribution.

    >>> import harness, numpy as np
    >>> driver = harness.LearnedDriver(harness.read_policy("policies/paper_merge/naive-seed11"), sampled=False)
    >>> driver.decide(games=np.arange(3), observation=np.zeros((3, 98)), noise=np.zeros((3, 2))).shape
    (3, 2)
    """

    takes_over = True

    def __init__(self, policy: Policy, sampled: bool) -> None:
        self._layers = [(weight.T.copy(), bias) for weight, bias in policy.layers("actor")]
        self._deviation = np.exp(policy.tensors["log_deviation"]) if sampled else None

    def reset(self, games: IntArray) -> None:
        """Do nothing: each decision depends on the current observation only."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]; `noise` [N, 2] is used if decisions are sampled."""
        return self._action(observation, noise)

    def decide_apart(self, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """As `decide`, each action with the bits that it has alone: a product for each row."""
        return self._action(observation[:, None], noise[:, None])[:, 0]

    def _action(self, observation: FloatArray, noise: FloatArray) -> FloatArray:
        hidden = observation
        for weight, bias in self._layers[:-1]:
            hidden = np.tanh(hidden @ weight + bias)
        weight, bias = self._layers[-1]
        action = hidden @ weight + bias
        if self._deviation is not None:
            action = action + self._deviation * noise
        return np.clip(action, -1.0, 1.0)


def write_policy(policy: Policy, folder: Path) -> None:
    """Write a policy's folder. Equal policies give equal bytes."""
    make_folder(folder)
    card_file, tensor_file = policy_files(folder)
    card = {"format": FORMAT, "observation": list(LAYOUT), **policy.card}
    tensors = {name: np.ascontiguousarray(tensor) for name, tensor in policy.tensors.items()}
    write_atomically(tensor_file, save_tensors(tensors))
    write_atomically(card_file, (json.dumps(card, indent=2) + "\n").encode())


def persona_hash(persona: Persona) -> str:
    """SHA-256 of what a policy learns by: the persona's document without `NO_TRAIT`."""
    learned_by = {key: value for key, value in persona.record().items() if key not in NO_TRAIT}
    return hashlib.sha256(json.dumps(learned_by, sort_keys=True).encode()).hexdigest()


def policy_files(folder: Path) -> tuple[Path, Path]:
    """The two files of a policy: its JSON and its parameters."""
    return folder / "policy.json", folder / "policy.safetensors"


def read_policy(folder: str | Path, layout: Sequence[str] = LAYOUT) -> Policy:
    """Read a policy's folder. Raises UsageError if it is missing, damaged, or was made for other observations than
    those with the names `layout`.

    >>> read_policy("policies/paper_merge/naive-seed11").card["player"]
    'ego'
    """
    card_file, tensor_file = policy_files(Path(folder))
    card = read_card(Path(folder))
    if card["format"] != FORMAT or card["observation"] != list(layout):
        message, remedy = "its format or its observation layout is not that of this version", "train it again"
        if card.get("personas"):
            message, remedy = "is a policy of several personas", "name that of one of them, from the folder beside it"
        raise UsageError.of(card_file, "observation", message, remedy)
    try:
        policy = Policy(load_tensors(_content(tensor_file, _MAX_TENSOR_BYTES)), card)
        _check_tensors(policy, len(layout))
    except (SafetensorError, ValueError, LookupError, TypeError, AttributeError, OverflowError, MemoryError) as error:
        raise UsageError.of(tensor_file, "", f"is damaged: {error}", "train the policy again") from None
    return policy


def read_card(folder: Path) -> dict[str, Any]:
    """The content of a policy's JSON. Raises UsageError if it is missing or damaged."""
    file = policy_files(folder)[0]
    try:
        content = _content(file, _MAX_CARD_BYTES).decode("utf-8")
        card = json.loads(content)
        if not isinstance(card, dict):
            raise TypeError("it contains no JSON object")
        if missing := [key for key in ("format", "observation") if key not in card]:
            raise ValueError(f"it has no {missing[0]!r}")
        PolicyCard.model_validate_json(content)
    except ValidationError as error:
        key, words = ".".join(map(str, error.errors()[0]["loc"])), error.errors()[0]["msg"]
        raise UsageError.of(file, key, f"is damaged: {words}", "train the policy again") from None
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise UsageError.of(file, "", f"is damaged: {error}", "train the policy again") from None
    return card


def _content(file: Path, max_bytes: int) -> bytes:
    try:
        return content_of(file, max_bytes)
    except (FileNotFoundError, NotADirectoryError):
        raise UsageError.of(file, "", "there is no such file", _POLICY_FOLDER) from None
    except OSError as error:
        raise UsageError.of(file, "", str(error.strerror), _POLICY_FOLDER) from None


def _check_tensors(policy: Policy, inputs: int) -> None:
    """Raises ValueError for parameters that are unknown, missing, of another shape, or no plausible numbers."""
    layers = [(match[1], int(match[2])) for match in map(_LAYER.match, policy.tensors) if match]
    expected = {f"{part}.{k}.{kind}" for part, last in layers for k in range(last + 1) for kind in ("weight", "bias")}
    expected.add("log_deviation")
    for name in sorted(policy.tensors.keys() - expected):
        raise ValueError(f"unknown parameters {name[:100]!r}: {nearest(name, expected)}")
    for name in sorted(expected - policy.tensors.keys()):
        raise ValueError(f"there are no parameters {name!r}")
    for part, outputs in (("actor", ACTIONS), ("critic", 1)):
        width = inputs
        for weight, bias in policy.layers(part):
            if weight.ndim != 2 or not weight.size or weight.shape[1] != width or bias.shape != weight.shape[:1]:
                raise ValueError(f"the {part}'s layers do not fit each other")
            width = weight.shape[0]
        if width != outputs:
            raise ValueError(f"the {part} has {width} outputs, not {outputs}")
    if policy.tensors["log_deviation"].shape != (ACTIONS,):
        raise ValueError("log_deviation does not fit the actions")
    for name, tensor in policy.tensors.items():
        if tensor.dtype != np.float32:
            raise ValueError(f"{name} is {tensor.dtype}, not float32")
        if not np.isfinite(tensor).all():
            raise ValueError(f"{name} is not finite")
        if np.abs(tensor).max() > _MAX_PARAMETER:
            raise ValueError(f"{name} has parameters over {_MAX_PARAMETER:g}")


def check_no_archive(file: Path, key: str, written: str, path: Path, *, remedy: str = "") -> None:
    """Raise UsageError if `path`, written as `written` under `key` in `file`, is a file and not a policy's folder.

    The archive of a training library is never opened, because pickles in it are programs. `remedy` is added to the
    message.
    """
    if os.path.isfile(path):
        what = "archives such as .zip, .pt and .pkl can carry pickles, which run code when they are opened"
        message = f"{written!r} is a file: {what}, so the harness does not read them"
        folder = "a policy is a folder with policy.safetensors and policy.json, as under <run>/policies/"
        raise UsageError.of(file, key, message, folder + remedy)
