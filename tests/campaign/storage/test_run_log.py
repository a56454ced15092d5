"""The log of a run: one line for each thing, and how the command ended."""

from __future__ import annotations

from pathlib import Path
from threading import Thread

import pytest

from harness.campaign.execution.run_campaign import log_event
from harness.campaign.execution.stage_run import Event
from harness.campaign.storage.run_log import LOG, LOGGER, run_log
from harness.errors import UsageError


def lines_of(folder: Path) -> list[str]:
    """The log's lines without their times; further lines of a message whole."""
    lines = (folder / LOG).read_text(encoding="utf-8").splitlines()
    return [line if line.startswith("    ") else line[21:] for line in lines]


def test_run_log__has_what_is_logged_meanwhile_and_is_appended_to(tmp_path: Path) -> None:
    for word in ("first", "second"):
        with run_log(tmp_path):
            LOGGER.info(word)
        LOGGER.error("outside")
    lines = lines_of(tmp_path)
    assert [line for line in lines if "harness" not in line] == [
        "INFO    first",
        "INFO    ended after 0 s",
        "INFO    second",
        "INFO    ended after 0 s",
    ]


def test_run_log__says_which_error_ended_the_command_and_where_if_it_is_a_bug(tmp_path: Path) -> None:
    for error in (UsageError.of("a.toml", "key", "is wrong"), ZeroDivisionError("a bug")):
        with pytest.raises(type(error)), run_log(tmp_path):
            raise error
    text = "\n".join(lines_of(tmp_path))
    assert "ERROR   ended by UsageError: a.toml: key: is wrong\nINFO " in text
    assert "ERROR   ended by ZeroDivisionError: a bug\n    Traceback" in text


def test_log_event__a_failure_is_an_error_and_can_not_imitate_a_line(tmp_path: Path) -> None:
    with run_log(tmp_path):
        log_event(Event(kind="started", stage="naive-seed1"))
        log_event(Event(kind="progress", stage="naive-seed1", done=1, total=2))
        log_event(Event(kind="failed", stage="naive-seed1", message="first\n2026-01-01T00:00:00Z INFO \x1b[2J"))
    assert lines_of(tmp_path)[1:-1] == [
        "INFO    started  naive-seed1",
        "ERROR   failed   naive-seed1: first",
        "    2026-01-01T00:00:00Z INFO \\x1b[2J",
    ]


def test_run_log__has_what_its_own_thread_logs(tmp_path: Path) -> None:
    """A league writes the results of a run while it plays the next one."""

    def write() -> None:
        with run_log(tmp_path / "written"):
            LOGGER.info("wrote the results")

    for name in ("played", "written"):
        (tmp_path / name).mkdir()
    with run_log(tmp_path / "played"):
        thread = Thread(target=write)
        thread.start()
        thread.join()
        LOGGER.info("played a game")
    played, written = ((tmp_path / name / LOG).read_text() for name in ("played", "written"))
    assert "played a game" in played
    assert "wrote the results" in written
    assert "wrote the results" not in played


def test_run_log__follows_no_link(tmp_path: Path) -> None:
    (tmp_path / LOG).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="is not a file"), run_log(tmp_path):
        pass
    assert not (tmp_path / "elsewhere").exists()
