"""Export of a policy as one network in a file, ONNX or TorchScript: its most likely action in every situation.

The network includes what the policy needs beside its weights: the scaling of `VecNormalize` before it, and the bounds
or the table of discrete actions after it. So the file drives as the policy does, without the library that trained it.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.config.driver import Onnx, StableBaselines3, TorchScript
from harness.drivers.driver_files import resolve_in
from harness.drivers.external import ExternalDriver
from harness.drivers.network_driver import read_network
from harness.drivers.policy_file import ACTIONS, Policy, read_policy
from harness.errors import UsageError
from harness.game.observation_layout import SIZE

if TYPE_CHECKING:
    import torch

KINDS = {".onnx": "onnx", ".pt": "torchscript"}
"""The kind of driver document of a file, by its ending."""
TOLERANCE = 1e-4
"""Largest difference of an action between the policy and its file: the order of summation differs."""
_COMPARED = 256


def export_network(driver: ExternalDriver, out: Path) -> float:
    """Write the policy of a driver to `out`, whose ending, .onnx or .pt, is the format. Returns the largest difference
    of an action over random observations.

    Raises UsageError if the driver is no policy, if it is recurrent, and if the file does not decide as the policy.
    """
    import torch

    ending = out.suffix.lower()
    if ending not in KINDS:
        raise UsageError.of(out, "", "this ending has no format", f"one of {', '.join(KINDS)}")
    network = _network_of(driver)
    seen = torch.from_numpy(np.random.default_rng(0).uniform(-1.0, 1.0, (_COMPARED, SIZE)).astype(np.float32))
    with torch.no_grad(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of tracing: the branches of a policy don't depend on the observation
        expected = network(seen).numpy()
        if ending == ".pt":
            torch.jit.trace(network, (seen[:2],)).save(str(out))
        else:
            names = {"input_names": ["observation"], "output_names": ["action"]}
            games = {"observation": {0: "games"}, "action": {0: "games"}}
            try:  # dynamo: the newer exporter needs one more package
                torch.onnx.export(network, (seen[:2],), str(out), **names, dynamic_axes=games, dynamo=False)
            except ImportError as error:
                raise UsageError.of(out, "", str(error), "pip install 'safedriverl-harness[onnx]'") from None
    kind: type[Onnx] | type[TorchScript] = Onnx if ending == ".onnx" else TorchScript
    document = kind.model_validate({"kind": KINDS[ending], "file": out.name})
    decided = np.asarray(read_network(document, out)(seen.numpy(), np.zeros((_COMPARED, ACTIONS))))
    difference = float(np.abs(decided - expected).max())
    if not difference <= TOLERANCE:
        what = f"it decides otherwise than the policy, by up to {difference:.3g}"
        raise UsageError.of(out, "", what, "the policy has a part that can't be traced: export it by its own library")
    return difference


def _network_of(driver: ExternalDriver) -> torch.nn.Module:
    if driver.document is None:
        return _of_layers(read_policy(driver.place))
    if not isinstance(driver.document, StableBaselines3):
        remedy = "name the folder of a policy, or a document of kind stable_baselines3"
        raise UsageError.of(driver.written, "", f"it is of kind {driver.kind}, which is no policy", remedy)
    if driver.document.algorithm == "RecurrentPPO":
        message = "a recurrent policy has a state, which a function of the observation has not"
        raise UsageError.of(driver.written, "algorithm", message, "let it drive from its own file")
    return _of_sb3(driver, driver.document)


def _of_layers(policy: Policy) -> torch.nn.Module:
    import torch

    parts: list[torch.nn.Module] = []
    for weight, bias in policy.layers("actor"):
        linear = torch.nn.Linear(weight.shape[1], weight.shape[0])
        linear.weight.data, linear.bias.data = torch.tensor(weight).float(), torch.tensor(bias).float()
        parts += [linear, torch.nn.Tanh()]
    return torch.nn.Sequential(*parts[:-1], torch.nn.Hardtanh()).eval()


def _of_sb3(driver: ExternalDriver, document: StableBaselines3) -> torch.nn.Module:
    import torch

    from harness.drivers.sb3_policy import read_sb3_policy

    normalize = resolve_in(driver.place, document.normalize) if document.normalize is not None else None
    saved = read_sb3_policy(document, resolve_in(driver.place, document.file), normalize)
    actions = torch.tensor(document.actions, dtype=torch.float32)

    normalised = saved.scaling is not None and saved.scaling.norm_obs

    class Whole(torch.nn.Module):
        """The policy with what it needs before and after it."""

        mean: torch.Tensor
        deviation: torch.Tensor

        def __init__(self) -> None:
            super().__init__()
            self.policy = saved.policy
            if normalised:
                moments = saved.scaling.obs_rms
                deviation = np.sqrt(moments.var + saved.scaling.epsilon)
                for name, values in (("mean", moments.mean), ("deviation", deviation)):
                    self.register_buffer(name, torch.tensor(values, dtype=torch.float32))

        def forward(self, observation: torch.Tensor) -> torch.Tensor:
            if normalised:
                largest = float(saved.scaling.clip_obs)
                observation = torch.clamp((observation - self.mean) / self.deviation, -largest, largest)
            decided: torch.Tensor = self.policy._predict(observation, deterministic=True)
            return actions[decided.long()] if saved.gives_index else torch.clamp(decided, -1.0, 1.0)

    return Whole().eval()
