"""A network in a file as a driver: ONNX, run by ONNX Runtime, or TorchScript, run by PyTorch.

An ONNX file is data (`drivers.onnx_network`). A TorchScript file contains a program and is code (`drivers.external`).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from harness.config.driver import Onnx, TorchScript
from harness.drivers.car import Car
from harness.drivers.onnx_network import OnnxNetwork
from harness.drivers.policy_file import ACTIONS
from harness.errors import DriverError, UsageError
from harness.game.arrays import FloatArray, IntArray

Network: TypeAlias = Callable[[FloatArray, FloatArray], Any]
"""Outputs for observations [N, SIZE] and noise [N, 2]."""


class NetworkDriver:
    """Drives by a function of the observation. It keeps no state."""

    takes_over = True

    def __init__(self, document: Onnx | TorchScript, file: Path, car: Car) -> None:
        """Read the network. Raises UsageError if it can't be read or does not fit."""
        self._network = read_network(document, file)
        self._car, self._file, self._si = car, file, document.units == "si"
        self._actions = np.array(document.actions, dtype=np.float64)

    def reset(self, games: IntArray) -> None:
        """Do nothing: each decision depends on the current observation only."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE] and noise [N, 2]. Raises DriverError if the network gives none."""
        seen = self._car.physical(observation) if self._si else observation
        answer = np.asarray(self._network(np.asarray(seen, dtype=np.float32), noise))
        if len(self._actions):
            return self._actions[self._indices(answer, len(games))]
        if answer.shape != (len(games), ACTIONS) or answer.dtype.kind not in "fiu":
            what = f"an array {list(answer.shape)} of {answer.dtype}, not numbers [{len(games)}, {ACTIONS}]"
            remedy = "; discrete actions need `actions` in the document" if answer.shape == (len(games),) else ""
            raise DriverError(f"{self._file.name} decided {what}{remedy}")
        actions = answer.astype(np.float64)
        if not np.isfinite(actions).all():
            raise DriverError(f"{self._file.name} decided numbers that are not finite")
        return self._car.answered(actions, observation, si=self._si)

    def _indices(self, answer: Any, games: int) -> IntArray:
        """The index of each game's action: the answer itself, or the place of the largest of its scores."""
        count = len(self._actions)
        if answer.shape == (games, count) and answer.dtype.kind == "f":
            return np.asarray(answer.argmax(axis=1))
        if answer.shape == (games,) and answer.dtype.kind in "iu" and answer.min() >= 0 and answer.max() < count:
            return np.asarray(answer, dtype=np.int64)
        what = f"{self._file.name} decided an array {list(answer.shape)} of {answer.dtype}"
        raise DriverError(f"{what}, not the index or the scores of {count} actions in each of {games} games")


def read_network(document: Onnx | TorchScript, file: Path) -> Network:
    """The function in a file. Raises UsageError if it can't be read or does not fit."""
    return OnnxNetwork(document, file) if isinstance(document, Onnx) else _torchscript(file)


def _torchscript(file: Path) -> Network:
    import warnings

    import torch

    torch.set_num_threads(1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            module = torch.jit.load(str(file), map_location="cpu").eval()
    except Exception as error:  # torch raises many kinds
        what = " ".join(f"can't be read as TorchScript: {error}".split())[:500]
        raise UsageError.of(file, "", what, "save it with torch.jit.save") from None

    def run(observation: FloatArray, noise: FloatArray) -> Any:
        with torch.no_grad():
            answer = module(torch.from_numpy(observation))
        if not isinstance(answer, torch.Tensor):
            raise DriverError(f"{file.name} returned {type(answer).__name__}, not a tensor")
        return answer.numpy()

    return run
