"""ONNX files are data: they read no file outside their folder, and take bounded time and memory."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import FunctionProto, GraphProto, NodeProto, TensorProto, helper

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.plan.plan import plan
from harness.campaign.preflight import open_campaign
from harness.config.driver import Onnx
from harness.drivers.car import Car
from harness.drivers.network_driver import NetworkDriver
from harness.drivers.onnx_network import OnnxNetwork
from harness.drivers.onnx_program import external_files
from harness.errors import DriverError, UsageError
from harness.game.observation_layout import SIZE
from tests.support.external_drivers import document, find
from tests.support.processes import children_of
from tests.support.tiny import CAREFUL, write_campaign

GAMES = np.arange(10)
SEEN = np.random.default_rng(3).uniform(-1.0, 1.0, (10, SIZE)).astype(np.float32)
NOISE = np.zeros((10, 2))
WEIGHTS = np.random.default_rng(5).normal(0.0, 0.1, (SIZE, 2)).astype(np.float32)


def outside(location: str, name: str = "weights") -> TensorProto:
    """A tensor [SIZE, 2] whose values are in another file."""
    tensor = TensorProto(name=name, data_type=TensorProto.FLOAT, dims=[SIZE, 2], data_location=TensorProto.EXTERNAL)
    tensor.external_data.add(key="location", value=location)
    return tensor


def inside(values: np.ndarray, name: str = "weights") -> TensorProto:
    return onnx.numpy_helper.from_array(values, name)


def model(
    file: Path,
    nodes: Sequence[NodeProto] = (),
    tensors: Sequence[TensorProto] = (),
    functions: Sequence[FunctionProto] = (),
    seen: str = "obs",
) -> Path:
    """A network that decides by `seen @ weights`, after the nodes."""
    last = helper.make_node("MatMul", [seen, "weights"], ["action"])
    values = [helper.make_tensor_value_info(*each) for each in (("obs", 1, ["n", SIZE]), ("action", 1, ["n", 2]))]
    graph = helper.make_graph([*nodes, last], "policy", values[:1], values[1:], tensors)
    opsets = [helper.make_opsetid("", 17), helper.make_opsetid("own", 1)]
    made = helper.make_model(graph, opset_imports=opsets, ir_version=8, functions=functions)
    file.write_bytes(made.SerializeToString())
    return file


def endless(file: Path) -> Path:
    """Its loop has no end."""
    scalars = [helper.make_tensor_value_info("k", TensorProto.INT64, []), helper.make_tensor_value_info("on", 9, [])]
    state = [helper.make_tensor_value_info(name, 1, ["n", SIZE]) for name in ("before", "after")]
    nodes = [helper.make_node("Identity", [a], [b]) for a, b in (("on", "still_on"), ("before", "after"))]
    on = helper.make_tensor_value_info("still_on", TensorProto.BOOL, [])
    body = helper.make_graph(nodes, "body", [*scalars, state[0]], [on, state[1]])
    loop = helper.make_node("Loop", ["", "true", "obs"], ["state"], body=body)
    return model(file, [loop], [inside(WEIGHTS), inside(np.array(True), "true")], seen="state")


def bomb(file: Path, when: str) -> Path:
    """A graph with a tensor of more than 2 GB, which is computed when the file is loaded, or from the observation: its
    length is constant, or follows from the number of games."""
    ones = inside(np.array([1_000_000_000 if when == "load" else 60_000_000], dtype=np.int64), "length")
    shape = [
        helper.make_node("Shape", ["obs"], ["games"], end=1),
        helper.make_node("Mul", ["games", "length"], ["long"]),
    ]
    nodes = [
        *(shape if when == "decide" else []),
        helper.make_node("ConstantOfShape", ["length" if when == "load" else "long"], ["large"]),
        helper.make_node("ReduceMax", ["large"], ["largest"], keepdims=0),
        helper.make_node("Add", ["obs", "largest"], ["sum"]),
    ]
    return model(file, nodes, [inside(WEIGHTS), ones], seen="sum")


def network(file: Path, **keys: Any) -> OnnxNetwork:
    return OnnxNetwork(Onnx.model_validate({"kind": "onnx", "file": file.name, **keys}), file)


# --- weights in other files ---


def constant(tensor: TensorProto) -> NodeProto:
    return helper.make_node("Constant", [], ["made"], value=tensor)


def graph(tensor: TensorProto) -> GraphProto:
    output = helper.make_tensor_value_info("made", TensorProto.FLOAT, [SIZE, 2])
    return helper.make_graph([constant(tensor)], "branch", [], [output])


PLACES: dict[str, dict[str, Any]] = {
    "an initialiser": {"tensors": [outside("w.bin")]},
    "an attribute": {"nodes": [constant(outside("w.bin"))]},
    "attributes": {"nodes": [helper.make_node("Own", [], ["y"], domain="own", values=[outside("w.bin")])]},
    "a subgraph": {
        "nodes": [helper.make_node("If", ["c"], ["y"], then_branch=graph(outside("w.bin")), else_branch=GraphProto())]
    },
    "a function": {
        "functions": [
            helper.make_function("own", "f", [], ["made"], [constant(outside("w.bin"))], [helper.make_opsetid("", 17)])
        ]
    },
}


@pytest.mark.parametrize("place", PLACES)
def test_external_files__of_tensors_wherever_they_are(place: str, tmp_path: Path) -> None:
    (tmp_path / "w.bin").write_bytes(WEIGHTS.tobytes())
    assert external_files(model(tmp_path / "a.onnx", **PLACES[place])) == ["w.bin"]


def test_external_files__none_of_weights_in_the_model(tmp_path: Path) -> None:
    (tmp_path / "a.onnx.data").write_bytes(b"of another model")
    assert external_files(model(tmp_path / "a.onnx", tensors=[inside(WEIGHTS)])) == []


@pytest.mark.parametrize(
    ("location", "message"),
    [
        ("../secret.bin", "are outside its folder (export it again, with the weights beside it)"),
        ("sub/../../secret.bin", "are outside its folder"),
        ("link.bin", "are outside its folder"),
        ("linked/secret.bin", "are outside its folder"),
        ("/etc/passwd", "are outside its folder"),
        ("w.bni", "can't be read: No such file or directory (copy that file too)"),
        ("sub", "can't be read: is a folder or a device, not a plain file"),
        ("a\0b", "can't be read: embedded null byte"),
        ("large.bin", "can't be read: is too large: 8,000 MB, at most 2,000 MB are read"),
    ],
)
def test_external_files__refuses_files_outside_the_folder_and_unreadable_ones(
    location: str, message: str, tmp_path: Path
) -> None:
    folder = tmp_path / "egos"
    (folder / "sub").mkdir(parents=True)
    (tmp_path / "secret.bin").write_bytes(WEIGHTS.tobytes())
    (folder / "link.bin").symlink_to("../secret.bin")
    (folder / "linked").symlink_to("..")
    (folder / "large.bin").touch()
    os.truncate(folder / "large.bin", 8_000_000_000)
    with pytest.raises(UsageError) as caught:
        external_files(model(folder / "a.onnx", tensors=[outside(location)]))
    assert f"{folder}/a.onnx: its weights in the file" in str(caught.value)
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_onnx__weights_outside_the_folder_are_refused_before_they_are_read(tmp_path: Path) -> None:
    folder = tmp_path / "egos"
    folder.mkdir()
    (tmp_path / "secret.bin").write_bytes(WEIGHTS.tobytes())
    file = model(folder / "a.onnx", tensors=[outside("../secret.bin")])
    name = document(folder, 'kind = "onnx"\nfile = "a.onnx"')
    for refused in (lambda: find(name, folder), lambda: network(file)):
        with pytest.raises(UsageError, match=r"a\.onnx: its weights in the file '\.\./secret\.bin' are outside its"):
            refused()


def test_onnx__changed_weights_change_the_keys_of_its_games(tmp_path: Path, car: Car) -> None:
    model(tmp_path / "a.onnx", tensors=[outside("sub/w.bin")])
    (tmp_path / "sub").mkdir()
    ego = {"driver": document(tmp_path, 'kind = "onnx"\nfile = "a.onnx"'), "persona": str(CAREFUL)}
    keys, decided = [], []
    for weights in (WEIGHTS, -WEIGHTS):
        (tmp_path / "sub" / "w.bin").write_bytes(weights.tobytes())
        campaign = open_campaign(write_campaign(tmp_path, ego=ego))
        assert campaign.ego_driver is not None
        assert "sub/w.bin" in campaign.hashes
        keys.append(stage_keys(campaign, plan(campaign.document, ["speedy"], campaign.tunable)))
        decided.append(campaign.ego_driver.make(car, False).decide(GAMES, SEEN, NOISE))
    assert {stage.removesuffix("-seed1") for stage in keys[0] if keys[0][stage] != keys[1][stage]} >= {
        "naive_alone",
        "naive_vs_speedy",
    }
    np.testing.assert_array_equal(decided[0], -decided[1])


# --- time and memory ---


def test_onnx__an_endless_loop_misses_the_deadline(tmp_path: Path, car: Car) -> None:
    endless(tmp_path / "a.onnx")
    driver = find(document(tmp_path, 'kind = "onnx"\nfile = "a.onnx"\ndeadline_s = 0.2'), tmp_path)
    expected = r"a\.onnx did not answer within 0\.2 s \(export a network that .* or raise `deadline_s`\)"
    with pytest.raises(UsageError, match=expected) as caught:
        driver.try_out(car, False)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("when", ["load", "decide"])
def test_onnx__more_memory_than_the_limit_is_an_error(when: str, tmp_path: Path) -> None:
    file = bomb(tmp_path / "a.onnx", when)
    assert file.stat().st_size < 2_000
    if when == "load":
        with pytest.raises(UsageError, match=r"a\.onnx: needs more than 2 GB of memory \(export a smaller network\)"):
            network(file)
    else:
        mine = network(file)
        with pytest.raises(DriverError, match=r"a\.onnx needs more than 2 GB of memory"):
            mine(SEEN, NOISE)
        np.testing.assert_allclose(mine(SEEN[:1], NOISE[:1]), SEEN[:1] @ WEIGHTS, atol=1e-6)


def test_onnx__a_process_that_died_is_started_anew(tmp_path: Path, car: Car) -> None:
    file = model(tmp_path / "a.onnx", tensors=[inside(WEIGHTS)])
    others = children_of(os.getpid())
    driver = NetworkDriver(Onnx(kind="onnx", file="a.onnx", units="scaled"), file, car)
    expected = driver.decide(GAMES, SEEN, NOISE)
    (process,) = set(children_of(os.getpid())) - set(others)
    os.kill(process, signal.SIGKILL)
    os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT)
    np.testing.assert_array_equal(driver.decide(GAMES, SEEN, NOISE), expected)
