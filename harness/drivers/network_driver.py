"""A network in a file as a driver: ONNX, run by ONNX Runtime, or TorchScript, run by PyTorch.

An ONNX file is data: its graph has operators of the standard only, and reads no file but its own weights. A TorchScript
file contains a program and is code (`drivers.external`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from harness.config.driver import Onnx, TorchScript
from harness.drivers.car import Car
from harness.drivers.policy_file import ACTIONS
from harness.errors import DriverError, UsageError
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation_layout import SIZE

NOISE = "noise"
"""The name of an input of an ONNX file that receives the noise."""
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
    return _onnx(document, file) if isinstance(document, Onnx) else _torchscript(file)


def _onnx(document: Onnx, file: Path) -> Network:
    try:
        import onnxruntime
    except ImportError:
        message = "ONNX files need ONNX Runtime, which is not installed"
        raise UsageError.of(file, "", message, "pip install 'safedriverl-harness[onnx]'") from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # small networks: threads would wait
    options.log_severity_level = 3
    try:
        session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # its exceptions have no base of their own
        what = " ".join(f"can't be read as an ONNX file: {error}".split())[:500]
        raise UsageError.of(file, "", what, "export it again, with operators of the standard only") from None
    inputs = {each.name: each for each in session.get_inputs()}
    outputs = [each.name for each in session.get_outputs()]
    seen, output = _names(document, file, inputs, outputs)
    kind = np.float64 if inputs[seen].type == "tensor(double)" else np.float32
    one_by_one = inputs[seen].shape[0] == 1

    def run(observation: FloatArray, noise: FloatArray) -> Any:
        feed = {seen: observation.astype(kind)}
        if NOISE in inputs:
            feed[NOISE] = noise.astype(np.float64 if inputs[NOISE].type == "tensor(double)" else np.float32)
        if not one_by_one:
            return session.run([output], feed)[0]
        games = ({name: values[k : k + 1] for name, values in feed.items()} for k in range(len(observation)))
        return np.concatenate([session.run([output], each)[0] for each in games])

    return run


def _names(document: Onnx, file: Path, inputs: Mapping[str, Any], outputs: list[str]) -> tuple[str, str]:
    """The input for the observation, and the output. Raises UsageError if the document or the file leaves them open."""
    wanted = [name for name in inputs if name != NOISE]
    for key, name, known in (("input", document.input, wanted), ("output", document.output, outputs)):
        if name is not None and name not in known:
            raise UsageError.of(file, key, f"it has no {key} {name!r}", f"it has {', '.join(known) or 'none'}"[:500])
    if len(wanted) != 1:
        what = f"it has {len(wanted)} inputs beside the noise: {', '.join(wanted)}"[:500]
        raise UsageError.of(file, "input", what, f"export it with one input [games, {SIZE}]; a state is not supported")
    shape, kind = inputs[wanted[0]].shape, inputs[wanted[0]].type
    floats = ("tensor(float)", "tensor(double)")
    if len(shape) != 2 or (isinstance(shape[1], int) and shape[1] != SIZE) or kind not in floats:
        what = f"its input {wanted[0]} is {kind} {shape}, not tensor(float) [games, {SIZE}]"
        raise UsageError.of(file, "input", what, "the observation is that of harness/Ego-v0")
    return wanted[0], document.output or outputs[0]


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
