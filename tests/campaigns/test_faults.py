"""Real faults under the real command: one message, what is done is kept, and running again ends as if nothing was."""

from __future__ import annotations

import io
import os
import resource
import shutil
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from harness.campaign.execution.run_campaign import run_campaign
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.run_stages import MOST_CRASHES
from harness.campaign.execution.stage_run import StageRun, Work
from harness.campaign.execution.worker_pool import WorkerPool
from harness.campaign.plan.stages import Stage
from harness.campaign.preflight import open_campaign
from harness.campaign.results.results import RunResult
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.tables import read_csv
from tests.support.shipped import stage
from tests.support.tiny import (
    BY_SUMO,
    HARNESS,
    PATIENCE_S,
    UNTRAINED,
    assert_interrupted,
    begin,
    carried_out,
    harness,
    sumo_run,
    tables,
    untrained_run,
    wait_for,
    workers_of,
    write_campaign,
)

pytestmark = pytest.mark.slow


# --- a dying simulator ------------------------------------------------------------------------------------------------


def die_in_game_1(stage: Stage, run: StageRun) -> dict[str, Any]:
    """Game 1 of one arm is SUMO's death; one of a training's segments is so once."""

    def begin_or_die(place: int) -> None:
        run.on_start(place)
        once = run.context.folder.path.with_name("died")
        if stage.id == "naive_vs_sumo-seed1" and place == 1:
            os.kill(os.getpid(), signal.SIGSEGV)
        if stage.id == "speedy-seed1" and place == 1 and not once.exists():
            once.touch()
            os.kill(os.getpid(), signal.SIGSEGV)

    return carry_out(stage, replace(run, on_start=begin_or_die))


def run_by(work: Work, folder: Path) -> tuple[RunResult, str]:
    """The campaign of `sumo_run`, its stages carried out by `work`; what came of it, and what was said."""
    said = io.StringIO()
    campaign = open_campaign(write_campaign(folder, **BY_SUMO))
    start_workers = partial(WorkerPool, jobs=1, work=work)
    outcome = run_campaign(campaign, RunFolder(folder / "run"), start_workers, Console(file=said, width=200))
    return outcome, said.getvalue()


def test_sigsegv__of_a_game_is_one_error_and_of_a_segment_none(tmp_path: Path) -> None:
    outcome, said = run_by(die_in_game_1, tmp_path)
    assert (outcome.error_games, outcome.failed_stages) == (1, {})  # for which the command's exit code is 1
    assert (
        f"naive_vs_sumo-seed1: the worker died of SIGSEGV, {MOST_CRASHES} times in game 1, which is abandoned" in said
    )
    games, expected = (read_csv(run / "episodes.csv") for run in (tmp_path / "run", sumo_run()))
    (bad,) = games.index[games["error"] != ""]
    assert games.loc[bad, ["arm", "episode", "ego_outcome"]].tolist() == ["naive_vs_sumo", 1, "error"]
    assert games.loc[bad, "error"] == f"the worker died of SIGSEGV, {MOST_CRASHES} times"
    assert games.drop(bad).equals(expected.drop(bad))
    assert (tmp_path / "run" / "training.csv").read_bytes() == (sumo_run() / "training.csv").read_bytes()

    outcome, said = run_by(carry_out, tmp_path)  # mended: the games in error are played again
    assert outcome.error_games == 0
    assert [line for line in said.splitlines() if line.startswith("started")] == ["started  naive_vs_sumo-seed1"]
    assert tables(tmp_path / "run") == tables(sumo_run())


# --- two at once, and requests to end ---------------------------------------------------------------------------------


def test_request_to_end__is_like_ctrl_c_and_a_second_command_is_refused(tmp_path: Path) -> None:
    campaign, run = write_campaign(tmp_path, **UNTRAINED), tmp_path / "run"
    first, report = ("campaign", campaign, "--out", run, "--jobs", 1), ("report", run)
    for number, code, second in ((signal.SIGTERM, 143, first), (signal.SIGHUP, 129, report)):
        process = begin(*first)
        wait_for(lambda leader=process.pid: workers_of(leader), "the first worker")  # type: ignore[misc]
        process.send_signal(signal.SIGSTOP)  # it must not end before it is asked to
        refused = harness(*second)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert refused.stderr.splitlines() == [
            f"{run}: is in use by process {process.pid} (wait until it has ended, or choose another folder with --out)"
        ]
        process.send_signal(number)
        process.send_signal(signal.SIGCONT)
        assert_interrupted(process, code)
    carried_out(campaign, run)
    assert tables(run) == tables(untrained_run())


# --- disk, permissions, memory ----------------------------------------------------------------------------------------


def limited(kind: int, most: int) -> Callable[[], None]:
    """Sets a limit in the process that is about to become the command."""
    return lambda: resource.setrlimit(kind, (most, most))


def assert_one_message(done: subprocess.CompletedProcess[str], words: str, codes: tuple[int, ...] = (1,)) -> None:
    assert done.returncode in codes, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert len(done.stderr.strip().splitlines()) <= 1, done.stderr
    assert words in done.stdout + done.stderr


def test_disk__that_takes_no_more_is_one_message(tmp_path: Path) -> None:
    campaign, run = write_campaign(tmp_path, **UNTRAINED), tmp_path / "run"
    for most_bytes in (3_000, 12_000):  # the manifest is larger; a trace is
        limit = limited(resource.RLIMIT_FSIZE, most_bytes)
        full = harness("campaign", campaign, "--out", run, "--jobs", 1, preexec_fn=limit)
        assert_one_message(full, "File too large")
        assert str(run) in full.stderr  # the file that could not be written
        assert not list(run.rglob(".*.part"))
    carried_out(campaign, run)
    assert tables(run) == tables(untrained_run())


def test_disk__that_is_full_is_one_message(tmp_path: Path) -> None:
    """A disk of 256 kB, where the machine lets us make one."""
    campaign, run = write_campaign(tmp_path, **UNTRAINED), tmp_path / "run"
    run.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", run], capture_output=True, check=False)
    if made.returncode:
        pytest.skip("only root can make a small disk")
    try:
        assert_one_message(harness("campaign", campaign, "--out", run, "--jobs", 1), "No space left on device")
        subprocess.run(["mount", "-o", "remount,size=50m", run], check=True)
        carried_out(campaign, run)
        assert tables(run) == tables(untrained_run())
    finally:
        subprocess.run(["umount", run], check=True)


def without_privileges(*arguments: object) -> subprocess.CompletedProcess[str]:
    """The command as somebody for whom permissions count, even where it is root who tests."""
    drop = ("setpriv", "--bounding-set", "-dac_override,-dac_read_search") if os.geteuid() == 0 else ()
    command = [*drop, HARNESS, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


@pytest.mark.skipif(os.geteuid() == 0 and not shutil.which("setpriv"), reason="root may write everywhere")
def test_folder__without_permission_is_one_message(tmp_path: Path) -> None:
    campaign, run = untrained_run().with_suffix(".toml"), shutil.copytree(untrained_run(), tmp_path / "run")
    shutil.rmtree(run / ".stages" / stage("naive_alone"))  # so that there is something to be done
    for name in (".", ".stages", "traces"):
        (run / name).chmod(0o555)
        try:
            refused = without_privileges("campaign", campaign, "--out", run, "--jobs", 1)
        finally:
            (run / name).chmod(0o755)
        assert_one_message(refused, "Permission denied", codes=(1, 2))
    carried_out(campaign, run)
    assert tables(run) == tables(untrained_run())
