"""Documents as nobody should write them: a project in order, ways to spoil it, and what must come of each.

Whatever is wrong: exit code 2, one line that names file and key, no traceback, nothing written, no process left,
within `MOST_CPU_S` of an ordinary machine's work and, on one that is busy with other things, `PATIENCE_S` in all.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from harness.campaign.results.results import write_results
from harness.campaign.storage.checksums import checksums_of
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOG
from harness.cli.main import main
from harness.drivers.policy_file import write_policy
from harness.errors import UsageError
from tests.support.policies import some_policy
from tests.support.repository import REPOSITORY
from tests.support.shared import built_once
from tests.support.tiny import CAREFUL, PATIENCE_S, sumo_run
from tests.support.work import assert_work

MOST_CPU_S = 5.0
CAMPAIGN, EGO, PERSONA = "campaigns/tiny.toml", "personas/careful.toml", "personas/anna.toml"
SCENE, NET, ROUTES = "networks/road/scene.toml", "networks/road/merge.net.xml", "networks/road/merge.rou.xml"
TENSORS, CARD = "policies/mine/policy.safetensors", "policies/mine/policy.json"
CHECK = ("check", CAMPAIGN)

CAMPAIGN_TEXT = """\
name = "tiny"
scene = "../networks/road"
personas = ["../personas/anna.toml"]
seeds = [1]
[ego]
driver = "../policies/mine"
persona = "../personas/careful.toml"
[training]
steps = 2048
learning_rate = 1e-4
games = 8
buffer = 512
minibatch = 128
network = [8]
clip = 0.1
[non_ego_training]
alone_share = 0.25
[assessment]
episodes = 4
significance = 0.01
"""
PERSONA_TEXT = """\
name = "anna"
description = "Somebody who wants to get there."
decisions = "mode"
[[sources]]
statistic = "Nobody has counted them."
citation = "nobody, nowhere"
[operational.terms]
goal = 2.0
progress = 1.0
[safety.terms]
clearance = { weight = 1.0, within_m = 1.0 }
[human]
weight = 1.0
[[human.fuzzy]]
name = "thrill"
quantity = "speed_over_limit"
sets = [{ name = "fast", points = [[0.0, 0.0], [0.2, 1.0]], value = 1.0 }]
[attention]
mean_attentive_s = 5.0
lapse_s = [1.0, 2.0]
[perception]
no_shoulder_glance_share = 0.5
"""

Spoil = Callable[[Path], object]


@dataclass(frozen=True)
class Bad:
    """One bad input: how the project is spoiled, and words that one line of the message has to hold."""

    name: str
    spoil: Spoil
    words: tuple[str, ...]
    command: tuple[str, ...] = CHECK

    def __repr__(self) -> str:
        return self.name


# --- ways to spoil a file ---------------------------------------------------------------------------------------------


def edit(file: str, old: str, new: str) -> Spoil:
    """Replace a piece of text, once."""

    def spoil(project: Path) -> None:
        text = (project / file).read_text(encoding="utf-8")
        assert old in text, f"{file} is no longer what this test breaks"
        (project / file).write_text(text.replace(old, new, 1), encoding="utf-8")

    return spoil


def several(*spoils: Spoil) -> Spoil:
    """One after another."""
    return lambda project: [spoil(project) for spoil in spoils]


def put(file: str, content: bytes | str) -> Spoil:
    """Other content altogether."""
    return lambda project: (project / file).write_bytes(content.encode() if isinstance(content, str) else content)


def rewritten(file: str, change: Callable[[bytes], bytes]) -> Spoil:
    """What a change makes of the file's bytes."""
    return lambda project: (project / file).write_bytes(change((project / file).read_bytes()))


def recode(file: str, encoding: str) -> Spoil:
    """The same text in another encoding."""
    return rewritten(file, lambda before: before.decode("utf-8").encode(encoding))


def inserted(file: str, content: bytes, share: float = 0.5) -> Spoil:
    """Bytes in the middle of the file."""
    return rewritten(
        file, lambda before: before[: int(len(before) * share)] + content + before[int(len(before) * share) :]
    )


def cut(file: str, share: float) -> Spoil:
    """The first part of the file alone."""
    return rewritten(file, lambda before: before[: int(len(before) * share)])


def instead(file: str, make: Callable[[Path], object]) -> Spoil:
    """Something else in the file's place."""

    def spoil(project: Path) -> None:
        (project / file).unlink()
        make(project / file)

    return spoil


def link(file: str, target: str) -> Spoil:
    """A symbolic link in the file's place; `{outside}` stands for a folder beside the project."""

    def make(path: Path) -> None:
        outside = next(folder for folder in path.parents if folder.name == "project").parent / "outside"
        outside.mkdir(exist_ok=True)
        (outside / "secret.txt").write_text("secret", encoding="utf-8")
        path.symlink_to(target.format(outside=outside))

    return instead(file, make)


def moved_out(file: str) -> Spoil:
    """The file itself, in order, but outside the project, with a link in its place."""

    def spoil(project: Path) -> None:
        outside = project.parent / "outside"
        outside.mkdir(exist_ok=True)
        shutil.move(project / file, outside / Path(file).name)
        (project / file).symlink_to(outside / Path(file).name)

    return spoil


def sparse(path: Path) -> None:
    """A file of a thousand million bytes that takes no room."""
    with path.open("wb") as file:
        file.truncate(10**9)


def whole_file(file: str, *, resolved: bool = False) -> list[Bad]:
    """What can be wrong with any file, whatever is to stand in it; each is named by the file (by what a link leads to,
    where the campaign's own paths are `resolved`)."""
    name = Path(file).name
    ways: dict[str, Spoil] = {
        "missing": lambda project: (project / file).unlink(),
        "empty": put(file, b""),
        "white space": put(file, b" \n\t\r\n"),
        "UTF-16": put(file, "\ufeffname = 'x' <a/>".encode("utf-16-le")),
        "UTF-32": put(file, "name = 'x' <a/>".encode("utf-32-le")),
        "Latin-1": inserted(file, "Zoë".encode("latin-1")),
        "NUL bytes": inserted(file, b"\0\0\0\0"),
        "zeros alone": put(file, bytes(2000)),
        "a picture": put(file, b"\x89PNG\r\n\x1a\n" + bytes(range(256))),
        "an archive": put(file, b"PK\x03\x04" + bytes(range(256))),
        "a program": put(file, "#!/bin/sh\ntouch /tmp/owned\n"),
        "half of it": cut(file, 0.5),
        "all but the last bytes": cut(file, 0.99),
        "a folder": instead(file, Path.mkdir),
        "a pipe": instead(file, os.mkfifo),
        "a device": link(file, "/dev/zero"),
        "a random device": link(file, "/dev/urandom"),
        "a link to nowhere": link(file, "nowhere"),
        "a link to itself": link(file, name),
        "a gigabyte": instead(file, sparse),
        "deeply nested lists": put(file, "[" * 200_000),
        "deeply nested tables": put(file, '{"a":' * 100_000),
        "deeply nested elements": put(file, "<a>" * 200_000),
    }
    return [
        Bad(f"{name}: {way}", spoil, ("/dev/",) if resolved and "device" in way else (name,))
        for way, spoil in ways.items()
    ]


NO_NUMBERS = {
    "not a number": "nan",
    "infinite": "inf",
    "minus infinite": "-inf",
    "huge": "1e308",
    "hugely negative": "-1e308",
    "beyond floating point": "1e400",
    "of 400 digits": "1" + "0" * 400,
    "of 400 digits, negative": "-1" + "0" * 400,
    "text": '"3"',
    "empty text": '""',
    "a truth value": "true",
    "a list": "[]",
    "a list of lists": "[[[]]]",
    "a table": "{}",
    "a date": "2024-01-01",
    "a time": "07:32:00",
}


def no_numbers(file: str, old: str, key: str, *words: str) -> list[Bad]:
    """What is no number that makes sense, in the place of one: `old` is `key = value` as the file has it."""
    begin, name = old.rpartition("=")[0], Path(file).name
    return [
        Bad(f"{name}: {key} {way}", edit(file, old, f"{begin}= {value}"), (name, *(words or [key])))
        for way, value in NO_NUMBERS.items()
    ]


def changed(file: str, *rows: tuple[str, str, str, tuple[str, ...]]) -> list[Bad]:
    """Rows of name, old text, new text, and words of the message beside the file's name."""
    name = Path(file).name
    return [Bad(f"{name}: {row}", edit(file, old, new), (name, *words)) for row, old, new, words in rows]


# --- the project ------------------------------------------------------------------------------------------------------


def write_project(folder: Path) -> Path:
    """A campaign and everything it names, in order: a copy of one that is written once."""
    return Path(shutil.copytree(built_once("project", _build_project), folder / "project"))


def _build_project(project: Path) -> None:
    for name in ("campaigns", "personas", "policies"):
        (project / name).mkdir(parents=True)
    (project / CAMPAIGN).write_text(CAMPAIGN_TEXT, encoding="utf-8")
    (project / PERSONA).write_text(PERSONA_TEXT, encoding="utf-8")
    shutil.copyfile(CAREFUL, project / EGO)
    shutil.copytree(REPOSITORY / "tests" / "data" / "merge", project / "networks" / "road")
    write_policy(some_policy(), project / "policies" / "mine")


def write_run(folder: Path) -> Path:
    """A run folder, in order, without what no command reads. A copy of one that is written once."""
    return Path(shutil.copytree(built_once("run_to_spoil", _build_run) / "run", folder / "project" / "run"))


def _build_run(folder: Path) -> None:
    unread = shutil.ignore_patterns("tensorboard", "checkpoint.safetensors")
    run = shutil.copytree(sumo_run(), folder / "run", ignore=unread)
    for record in run.glob(".stages/*/done.json"):
        document = json.loads(record.read_text(encoding="utf-8"))
        kept = {name: each for name, each in document["files"].items() if (run / name).is_file()}
        record.write_text(json.dumps({**document, "files": kept}), encoding="utf-8")
    write_results(RunFolder(run), Console(quiet=True))  # its record of what the results were made from fits again


def seal(run: Path) -> None:
    """Make the checksums of a run folder fit its files: who changes a file on purpose can change those as well."""
    with suppress(UsageError):
        RunFolder(run).write_manifest(RunFolder(run).manifest())
    for record in (run / ".stages" / "results.json", *run.glob(".stages/*/done.json")):
        if record.is_file():
            document = json.loads(record.read_text(encoding="utf-8"))
            document["files"] |= checksums_of(run, [run / name for name in document["files"] if (run / name).is_file()])
            record.write_text(json.dumps(document), encoding="utf-8")


def traces_of(folder: Path) -> dict[str, str]:
    """Everything below a folder but logs of runs, which say what each command did: its kind, where a link leads, and
    what is in it."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.name == LOG and not path.is_symlink():
            continue
        status = path.lstat()
        text = f"{stat.S_IFMT(status.st_mode):o} {status.st_size if stat.S_ISREG(status.st_mode) else ''}"
        if path.is_symlink():
            text += os.readlink(path)
        elif stat.S_ISREG(status.st_mode) and status.st_size < 10**8:
            text += hashlib.sha256(path.read_bytes()).hexdigest()
        found[str(path.relative_to(folder))] = text
    return found


def children() -> set[str]:
    """The processes that this one has started and that are there still."""
    lists = Path("/proc/self/task").glob("*/children")
    return {child for each in lists for child in each.read_text().split()}


ONE_IN = 8


def all_at_release(rows: Sequence[Bad]) -> list[Any]:
    """A case for each row: `make test` tries one in `ONE_IN` of them, `make test-release` all."""
    return [
        pytest.param(row, id=repr(row), marks=[pytest.mark.slow] if k % ONE_IN else []) for k, row in enumerate(rows)
    ]


# --- what must come of it ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Said:
    """How a command ended."""

    code: int
    out: str
    err: str
    seconds: float
    cpu_s: float


class Desk:
    """Runs the command in this process, from a folder and with a scratch folder that are watched with the project."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self._monkeypatch, self._capsys = folder, monkeypatch, capsys
        self.project = write_project(folder)
        for name in ("here", "scratch"):
            (folder / name).mkdir()
        monkeypatch.chdir(folder / "here")
        monkeypatch.setenv("TMPDIR", str(folder / "scratch"))
        monkeypatch.setattr(tempfile, "tempdir", str(folder / "scratch"))

    def run(self, command: tuple[str, ...]) -> Said:
        verb, named, *more = command
        self._monkeypatch.setattr("sys.argv", ["harness", verb, str(self.project / named), *more])
        self._capsys.readouterr()
        began, worked = time.monotonic(), sum(os.times()[:4])
        with pytest.raises(SystemExit) as stopped:
            main()
        code = stopped.value.code
        took_s, cpu_s = time.monotonic() - began, sum(os.times()[:4]) - worked
        return Said(0 if code is None else int(code), *self._capsys.readouterr(), took_s, cpu_s)

    def refuses(self, bad: Bad) -> None:
        """Spoil the project and see that the command says so, as it must."""
        bad.spoil(self.project)
        seal(self.project / "run")
        before, running = traces_of(self.folder), children()
        said = self.run(bad.command)
        assert_refused(said, bad.words)
        assert traces_of(self.folder) == before, "something was written"
        assert children() == running, "a process is left"


def assert_refused(said: Said, words: tuple[str, ...]) -> None:
    assert said.code == 2, said.out + said.err
    assert said.out == ""
    assert "Traceback" not in said.err
    lines = said.err.splitlines()
    assert any(all(word in line for word in words) for line in lines), f"{words} not in: {said.err[:2000]}"
    assert all(len(line) < 10_000 and line.isprintable() for line in lines)
    assert_work(said.cpu_s, MOST_CPU_S)
    assert said.seconds < PATIENCE_S, f"it took {said.seconds:.1f} s"
