"""Networks in ONNX and TorchScript files drive; policies are exported to them and decide the same."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import sb3_contrib
import stable_baselines3
import torch
from onnx import TensorProto, helper
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from harness.config.driver import Onnx, TorchScript
from harness.drivers.car import Car
from harness.drivers.network_driver import NetworkDriver
from harness.drivers.network_export import export_network
from harness.drivers.policy_file import write_policy
from harness.drivers.sb3_policy import Sb3Driver
from harness.errors import DriverError, UsageError
from harness.game.observation_layout import LAYOUT, SIZE
from tests.support.external_drivers import document, find
from tests.support.observations import Recorded
from tests.support.policies import some_policy

torch.set_num_threads(1)
GAMES = np.arange(5)
SEEN = np.random.default_rng(3).uniform(-1.0, 1.0, (5, SIZE)).astype(np.float32)
NOISE = np.random.default_rng(4).standard_normal((5, 2))
WEIGHTS = np.random.default_rng(5).normal(0.0, 0.1, (SIZE, 2)).astype(np.float32)


def onnx_file(
    file: Path, weights: np.ndarray = WEIGHTS, games: Any = "games", noise: bool = False, seen: int = SIZE
) -> Path:
    """tanh(observation @ weights), plus the noise."""
    inputs = [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [games, seen])]
    nodes = [helper.make_node("MatMul", ["obs", "weights"], ["sum"]), helper.make_node("Tanh", ["sum"], ["mode"])]
    if noise:
        inputs.append(helper.make_tensor_value_info("noise", TensorProto.FLOAT, [games, 2]))
        nodes.append(helper.make_node("Add", ["mode", "noise"], ["action"]))
    outputs = [helper.make_tensor_value_info("action" if noise else "mode", TensorProto.FLOAT, [games, None])]
    initial = [helper.make_tensor("weights", TensorProto.FLOAT, weights.shape, weights.flatten())]
    graph = helper.make_graph(nodes, "policy", inputs, outputs, initial)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), file)
    return file


def of_onnx(file: Path, car: Car, **keys: Any) -> NetworkDriver:
    return NetworkDriver(Onnx.model_validate({"kind": "onnx", "file": file.name, **keys}), file, car)


@pytest.mark.parametrize("games", ["games", 1])
def test_onnx__decides_by_the_graph(games: Any, tmp_path: Path, car: Car) -> None:
    driver = of_onnx(onnx_file(tmp_path / "a.onnx", games=games), car)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), np.tanh(SEEN @ WEIGHTS), atol=1e-6)


def test_onnx__an_input_called_noise_receives_it(tmp_path: Path, car: Car) -> None:
    driver = of_onnx(onnx_file(tmp_path / "a.onnx", noise=True), car)
    expected = np.clip(np.tanh(SEEN @ WEIGHTS) + NOISE, -1.0, 1.0)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-6)


def test_onnx__may_have_si_units(tmp_path: Path, car: Car) -> None:
    weights = np.zeros((SIZE, 2), dtype=np.float32)
    weights[LAYOUT.index("speed_mps"), 0] = -0.01
    driver = of_onnx(onnx_file(tmp_path / "a.onnx", weights), car, units="si")
    speed_mps = car.physical(SEEN)[:, LAYOUT.index("speed_mps")]
    expected = car.actions(np.tanh(-0.01 * speed_mps), np.zeros(5), SEEN)
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-6)


def test_onnx__scores_of_discrete_actions_choose_one(tmp_path: Path, car: Car) -> None:
    weights = np.random.default_rng(6).normal(0.0, 0.1, (SIZE, 3)).astype(np.float32)
    table = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]
    driver = of_onnx(onnx_file(tmp_path / "a.onnx", weights), car, actions=table)
    np.testing.assert_array_equal(driver.decide(GAMES, SEEN, NOISE), np.array(table)[(SEEN @ weights).argmax(axis=1)])
    with pytest.raises(DriverError, match=r"decided an array \[5, 3\] of float32, not numbers \[5, 2\]"):
        of_onnx(tmp_path / "a.onnx", car).decide(GAMES, SEEN, NOISE)


@pytest.mark.parametrize(("key", "name", "known"), [("input", "state", "obs"), ("output", "actoin", "mode")])
def test_onnx__a_name_that_it_has_not_is_an_error(key: str, name: str, known: str, tmp_path: Path, car: Car) -> None:
    with pytest.raises(UsageError, match=rf"{key}: it has no {key} '{name}' \(it has {known}\)"):
        of_onnx(onnx_file(tmp_path / "a.onnx"), car, **{key: name})


def test_onnx__another_observation_is_refused(tmp_path: Path, car: Car) -> None:
    with pytest.raises(UsageError, match=r"input obs is tensor\(float\) .*12\], not tensor\(float\) \[games, 98\]"):
        of_onnx(onnx_file(tmp_path / "a.onnx", WEIGHTS[:12], seen=12), car)
    with pytest.raises(UsageError, match=r"input obs is tensor\(float\) \[4, 98\], .* number of games is free or 1"):
        of_onnx(onnx_file(tmp_path / "a.onnx", games=4), car)
    (tmp_path / "b.onnx").write_bytes(b"nothing")
    with pytest.raises(UsageError, match="can't be read as an ONNX file"):
        of_onnx(tmp_path / "b.onnx", car)


def test_onnx__is_data_and_torchscript_is_code(tmp_path: Path) -> None:
    onnx_file(tmp_path / "a.onnx")
    name = document(tmp_path, 'kind = "onnx"\nfile = "a.onnx"')
    assert {Path(each).name for each in find(name, tmp_path, allow_code=False).files} == {"a.onnx"}
    name = document(tmp_path, 'kind = "torchscript"\nfile = "a.onnx"')
    with pytest.raises(UsageError, match=r"runs a TorchScript module, which is a program.*--allow-code"):
        find(name, tmp_path, allow_code=False)


def test_torchscript__decides_by_the_module(tmp_path: Path, car: Car) -> None:
    linear = torch.nn.Linear(SIZE, 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.jit.script(torch.nn.Sequential(linear, torch.nn.Tanh())).save(str(tmp_path / "a.pt"))
    keys = TorchScript.model_validate({"kind": "torchscript", "file": "a.pt"})
    driver = NetworkDriver(keys, tmp_path / "a.pt", car)
    with torch.no_grad():
        expected = torch.tanh(linear(torch.from_numpy(SEEN))).numpy()
    np.testing.assert_allclose(driver.decide(GAMES, SEEN, NOISE), expected, atol=1e-6)
    (tmp_path / "b.pt").write_bytes(b"nothing")
    with pytest.raises(UsageError, match="can't be read as TorchScript"):
        NetworkDriver(keys, tmp_path / "b.pt", car)


@pytest.mark.parametrize("ending", ["onnx", "pt"])
@pytest.mark.parametrize("name", ["PPO", "SAC", "TD3", "DQN", "TQC"])
def test_export__decides_as_the_policy_does(name: str, ending: str, tmp_path: Path, car: Car) -> None:
    env = VecNormalize(DummyVecEnv([lambda: Recorded(discrete=name == "DQN")]))
    small: dict[str, Any] = {"n_steps": 8, "batch_size": 8} if name == "PPO" else {"buffer_size": 50}
    algorithm = getattr(stable_baselines3, name, None) or getattr(sb3_contrib, name)
    model = algorithm("MlpPolicy", env, device="cpu", seed=1, policy_kwargs={"net_arch": [8]}, **small)
    for _ in range(8):
        env.reset()  # the statistics of the observations
    model.save(tmp_path / "mine.zip")
    env.save(str(tmp_path / "vn.pkl"))
    actions = "actions = [[-1.0, 0.0], [0.0, 0.5], [1.0, 0.0]]\n" if name == "DQN" else ""
    text = f'kind = "stable_baselines3"\nfile = "mine.zip"\nalgorithm = "{name}"\nnormalize = "vn.pkl"\n{actions}'
    saved = find(document(tmp_path, text), tmp_path)
    export_network(saved, tmp_path / f"new.{ending}")
    kind = "onnx" if ending == "onnx" else "torchscript"
    exported = find(document(tmp_path, f'kind = "{kind}"\nfile = "new.{ending}"', "new.toml"), tmp_path)
    decided = exported.make(car, False).decide(GAMES, SEEN, NOISE)
    np.testing.assert_allclose(decided, saved.make(car, False).decide(GAMES, SEEN, NOISE), atol=1e-5)
    assert isinstance(saved.make(car, False), Sb3Driver)


def test_export__of_a_policy_of_a_campaign(tmp_path: Path, car: Car) -> None:
    (tmp_path / "naive-seed1").mkdir()
    write_policy(some_policy(), tmp_path / "naive-seed1")
    policy = find("naive-seed1", tmp_path)
    export_network(policy, tmp_path / "new.onnx")
    exported = find(document(tmp_path, 'kind = "onnx"\nfile = "new.onnx"'), tmp_path)
    expected = policy.make(car, False).decide(GAMES, SEEN, NOISE)
    np.testing.assert_allclose(exported.make(car, False).decide(GAMES, SEEN, NOISE), expected, atol=1e-5)


def test_export__what_is_no_function_of_the_observation_is_refused(tmp_path: Path) -> None:
    driver = find(document(tmp_path, 'kind = "sumo"\nvehicle_type = "idm"'), tmp_path)
    with pytest.raises(UsageError, match="it is of kind sumo, which is no policy"):
        export_network(driver, tmp_path / "new.onnx")
    with pytest.raises(UsageError, match=r"no format \(one of \.onnx, \.pt\)"):
        export_network(driver, tmp_path / "new.bin")
