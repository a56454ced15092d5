"""Stages on a Ray cluster: the bytes of a run on this machine, whatever dies. A node that does not fit is refused."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.execution.ray_workers import RayWorkers, ray_cluster
from harness.campaign.execution.run_stages import MOST_CRASHES, run_stages
from harness.campaign.execution.stage_run import Event, StageRun
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.run_folder import RunFolder
from tests.support.plans import empty_context, training_of
from tests.support.processes import in_session
from tests.support.ray_nodes import add_node, busy_process, cluster_of, pull_the_plug
from tests.support.tiny import (
    BY_SUMO,
    PATIENCE_S,
    assert_interrupted,
    begin,
    carried_out,
    end,
    harness,
    numbers,
    sumo_run,
    wait_for,
    without,
    write_campaign,
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with cluster_of(2) as running:
        yield running


def begin_campaign(tmp_path: Path, address: str) -> tuple[Any, Path, Path]:
    """The campaign of `sumo_run`, begun on a cluster, one stage at a time; returned when its training has a segment."""
    campaign, run = write_campaign(tmp_path, **BY_SUMO), tmp_path / "run"
    process = begin("campaign", campaign, "--out", run, "--jobs", 1, "--ray", address)
    checkpoint = run / ".stages" / "speedy-seed1" / "checkpoint.safetensors"
    wait_for(lambda: checkpoint.exists() or process.poll() is not None, "the first segment")
    assert checkpoint.exists(), end(process)
    return process, campaign, run


# --- the real command -------------------------------------------------------------------------------------------------


def test_ray__a_node_that_dies_costs_nothing_but_time(cluster: Any, tmp_path: Path) -> None:
    process, _, run = begin_campaign(tmp_path, cluster.address)
    (node,) = (node for node in cluster.worker_nodes if busy_process(node))
    pull_the_plug(cluster, node)
    printed = end(process)
    add_node(cluster)
    assert process.returncode == 0, printed
    assert "crashed  speedy-seed1: " in printed
    assert "\nfailed " not in printed
    assert numbers(run) == numbers(sumo_run())


def test_ray__a_command_that_is_killed_and_run_again_is_uninterrupted(cluster: Any, tmp_path: Path) -> None:
    """The second command waits until Ray has ended the worker of the first one, which has no command any more."""
    process, campaign, run = begin_campaign(tmp_path, cluster.address)
    os.kill(process.pid, signal.SIGKILL)
    end(process)
    carried_out(campaign, run, "--ray", cluster.address)
    assert numbers(run) == numbers(sumo_run())


def test_ray__on_this_machine_alone_interrupted_leaves_nothing(tmp_path: Path) -> None:
    process, campaign, run = begin_campaign(tmp_path, "local")
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    assert_interrupted(process, 130)
    carried_out(campaign, run)  # without Ray: either continues what the other began
    assert numbers(run) == numbers(sumo_run())


def assert_refused(cluster: Any, tmp_path: Path, run: Path, message: str) -> None:
    """The command ends with exit code 2 and one message, and begins nothing."""
    refused = harness("campaign", write_campaign(tmp_path, **BY_SUMO), "--out", run, "--ray", cluster.address)
    assert refused.returncode == 2, refused.stdout + refused.stderr
    (line,) = refused.stderr.splitlines()
    assert line.startswith(message)
    assert "started" not in refused.stdout


def test_ray__nodes_of_other_versions_are_refused_by_name(cluster: Any, tmp_path: Path) -> None:
    """A node on which another release of numba is found before the one that is installed."""
    (tmp_path / "other" / "numba-0.1.dist-info").mkdir(parents=True)
    metadata = "Metadata-Version: 2.1\nName: numba\nVersion: 0.1\n"
    (tmp_path / "other" / "numba-0.1.dist-info" / "METADATA").write_text(metadata)
    path = os.pathsep.join([str(tmp_path / "other"), *filter(None, [os.environ.get("PYTHONPATH")])])
    node = add_node(cluster, env_vars={"PYTHONPATH": path}, node_name="old-machine")
    message = "--ray: node old-machine: has other versions than this machine: numba 0.1, here "
    try:
        assert_refused(cluster, tmp_path, tmp_path / "run", message)
    finally:
        cluster.remove_node(node)


def test_ray__a_node_that_does_not_see_the_run_folder_is_refused_by_name(cluster: Any, tmp_path: Path) -> None:
    """A node with an empty disk where the others have the run folder, where the machine lets us mount one."""
    folder = tmp_path / "shared"
    folder.mkdir()
    start = f"{Path(sys.executable).with_name('ray')} start --address={cluster.address} --num-cpus=1 --node-name=island"
    script = f"mount -t tmpfs tmpfs {folder} && {start} --object-store-memory=80000000"
    island = subprocess.Popen(
        ["unshare", "--mount", "sh", "-c", script],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        if island.wait(PATIENCE_S):
            assert island.stderr is not None
            pytest.skip(f"no node with a disk of its own: {island.stderr.read()}")
        message = f"--ray: node island: does not see the run folder {folder / 'run'} (use a folder that "
        assert_refused(cluster, tmp_path, folder / "run", message)
    finally:
        for pid in in_session(island.pid):
            os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("127.0.0.1:1", "--ray: 127.0.0.1:1: no Ray cluster answers: [Errno 111] Connection refused (start one with: "),
        ("somewhere", "--ray: somewhere: is not an address of a Ray cluster (write local, auto or HOST:PORT, "),
    ],
)
def test_ray__a_bad_address_is_refused_at_once(address: str, message: str, tmp_path: Path) -> None:
    refused = harness("campaign", write_campaign(tmp_path, **BY_SUMO), "--ray", address, timeout_s=60.0)
    assert refused.returncode == 2
    assert refused.stderr.startswith(message), refused.stderr


def test_ray__that_is_not_installed_is_named_with_the_remedy(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, **BY_SUMO)
    refused = harness("campaign", campaign, "--ray", "local", env=without(tmp_path, "ray"))
    assert refused.returncode == 2
    assert (
        refused.stderr == "--ray: local: needs Ray, which is not installed (pip install 'safedriverl-harness[ray]')\n"
    )


# --- deaths of workers ------------------------------------------------------------------------------------------------


def die_in_segments(stage: Stage, run: StageRun) -> dict[str, Any]:
    """`a` dies in its second segment twice, `b` in every run.attempt."""
    times = run.context.folder.path / f"{stage.id}.times"
    times.write_text(times.read_text() + "x" if times.exists() else "x")
    run.on_start(0)
    run.on_start(1)
    if stage.id == "b-seed1" or (stage.id == "a-seed1" and len(times.read_text()) < MOST_CRASHES):
        os.kill(os.getpid(), signal.SIGSEGV)
    return {"first": run.attempt.first}


def test_ray__deaths_of_workers_follow_the_rule_of_the_harness(cluster: Any, tmp_path: Path) -> None:
    stages = [training_of("a"), training_of("b"), training_of("c", "b"), training_of("d", "a")]
    events: list[Event] = []
    folder = RunFolder(tmp_path / "run")
    folder.claim("deaths")
    with ray_cluster(cluster.address, None) as ray, folder.held():
        context = empty_context(folder.path)
        with RayWorkers(context, ray=ray, jobs=2, warn=pytest.fail, work=die_in_segments) as workers:
            run_stages(stages, [], workers, events.append)
    told = [f"{event.kind} {event.stage.removesuffix('-seed1')}" for event in events]
    assert told.count("crashed a") == told.count("crashed b") == MOST_CRASHES - 1
    assert told.count("started b") == MOST_CRASHES
    assert {"done a", "done d", "failed b", "skipped c"} <= set(told)
    (failed,) = (event.message for event in events if event.kind == "failed")
    assert failed.startswith("the worker on node ")
    assert failed.endswith(f" died, {MOST_CRASHES} times")
    (done,) = (event.info for event in events if event.kind == "done" and event.stage == "a-seed1")
    assert done == {"first": False}
