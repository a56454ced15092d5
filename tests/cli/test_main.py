"""The command line: help, clear messages about mistakes, and no files written after a mistake."""

from __future__ import annotations

import importlib
import json
import re
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import pytest
import typer
from junitparser import JUnitXml

from harness.campaign.plan.persona_remarks import persona_remarks
from harness.campaign.plan.plan import plan
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.cli import messages
from harness.cli.app import app
from harness.cli.main import CONTINUES, INTERRUPTED, main
from harness.errors import FAILED, NOT_ACCEPTED, USAGE_ERROR, SimulationError
from harness.evaluation.tables import read_csv
from harness.evaluation.worst_first import FAILURES
from tests.support.forked_command import can_fork
from tests.support.repository import REPOSITORY
from tests.support.tiny import (
    TABLES,
    assert_interrupted,
    begin_program,
    learned_run,
    sumo_run,
    tables,
    wait_for,
    write_campaign,
)


class Result(NamedTuple):
    """The exit code and the output of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def run_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Result]:
    """Run the command in this process, which is faster than in a process of its own."""
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("TERMINAL_WIDTH", "200")

    def run(*arguments: object) -> Result:
        monkeypatch.setattr("sys.argv", ["harness", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        code = stopped.value.code
        return Result(0 if code is None else int(code), *capsys.readouterr())

    return run


# --- help -------------------------------------------------------------------------------------------------------------


def commands(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """A command and every command in it, by name."""
    yield name, command
    for inner, each in getattr(command, "commands", {}).items():
        yield from commands(each, f"{name} {inner}".strip())


COMMANDS = dict(commands(typer.main.get_command(app)))


def words_of(text: str) -> str:
    """A text without markup, frames and line breaks."""
    return " ".join(re.sub(r"[`│╭╮╰╯─]", " ", text).split())


@pytest.mark.parametrize("command", COMMANDS)
def test_help__describes_the_command_and_its_parameters(command: str, run_command: Callable[..., Result]) -> None:
    result = run_command(*command.split(), "--help")
    shown, described = words_of(result.out), COMMANDS[command]
    assert result.code == 0
    assert words_of(str(described.help)) in shown
    for parameter in described.params:
        assert (parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar) in shown
    for name in getattr(described, "commands", {}):
        assert name in shown


def test_help__names_the_exit_codes(run_command: Callable[..., Result]) -> None:
    shown = words_of(run_command("--help").out)
    assert words_of(str(app.info.epilog)) in shown
    for code in (FAILED, USAGE_ERROR, NOT_ACCEPTED, 128 + signal.SIGINT, 128 + signal.SIGTERM):
        assert str(code) in str(app.info.epilog)


# --- run folders ------------------------------------------------------------------------------------------------------


def test_check__lists_the_stages_and_writes_nothing(tmp_path: Path, run_command: Callable[..., Result]) -> None:
    campaign = write_campaign(tmp_path)
    result = run_command("check", campaign)
    assert result.code == 0
    opened = open_campaign(campaign)
    stages = plan(opened.document, [persona.name for persona in opened.personas], opened.tunable)
    warnings = persona_remarks(opened.personas, opened.scene.world, opened.document.training.discount)
    lines = [f"{campaign} is in order.", *warnings, messages.work(opened, stages), *messages.stage_lines(stages)]
    lines.append("Holm's correction over 2 tests about this trained pair: RQ1 speedy, RQ2 speedy (training seed 1)")
    assert result.out.splitlines() == lines
    assert lines[len(warnings) + 1] == "3 trainings of up to 2,048 steps, 6 arms of 4 episodes:"
    assert "  assess naive_vs_speedy-seed1  after naive-seed1, speedy-seed1" in lines
    assert list(tmp_path.iterdir()) == [campaign]


def test_check__stages_of_several_seeds_share_a_line(run_command: Callable[..., Result]) -> None:
    lines = run_command("check", REPOSITORY / "campaigns" / "merge-robust.toml").out.splitlines()
    assert "  derive speedy  after people" in lines
    assert "  train  robust  after careful, cautious, speedy, tailgater, texting of other seeds" in lines
    assert "  assess robust_vs_speedy  after robust, speedy" in lines
    assert "Each for the training seeds 91, 92, 93, 94, 95." in lines
    assert not any("seed91" in each for each in lines)


@pytest.mark.parametrize(
    ("given", "file", "kind", "remedy"),
    [
        ("check", "personas/speedy.toml", "a persona", "check it with: harness persona check {path}"),
        ("campaign", "personas/speedy.toml", "a persona", "check it with: harness persona check {path}"),
        ("campaign", "egos/adas.toml", "a driver", "check it with: harness check-driver {path}"),
        ("campaign", "networks/merge", "a scene", 'name it in a campaign: scene = "{path}"'),
    ],
)
def test_campaign__that_is_another_document_says_so(
    given: str, file: str, kind: str, remedy: str, run_command: Callable[..., Result]
) -> None:
    path = REPOSITORY / file
    assert run_command(given, path).err == f"{path}: is {kind}, not a campaign ({remedy.format(path=path)})\n"


def test_report__needs_only_the_folder_even_after_a_move(tmp_path: Path, run_command: Callable[..., Result]) -> None:
    moved = shutil.copytree(learned_run(), tmp_path / "elsewhere" / "[red] moved")
    for name in (*TABLES, "training.csv"):
        (moved / name).unlink()
    shutil.rmtree(moved / "replays")
    (moved / "report.html").unlink()
    result = run_command("report", moved)
    assert result.code == 0, result.err
    assert str(moved / "report.html") in result.out
    assert tables(moved) == tables(learned_run())
    assert (moved / "training.csv").read_bytes() == (learned_run() / "training.csv").read_bytes()
    assert (moved / "report.html").read_bytes() == (learned_run() / "report.html").read_bytes()
    replays = [{each.name for each in (run / "replays").iterdir()} for run in (moved, learned_run())]
    assert replays[0] == replays[1]


@pytest.mark.parametrize(("bound", "code", "word"), [(1.0, 0, "PASS"), (0.0, NOT_ACCEPTED, "FAIL")])
def test_report__judges_the_bounds_of_the_campaign(
    bound: float, code: int, word: str, tmp_path: Path, run_command: Callable[..., Result]
) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "run")
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    manifest["campaign"]["acceptance"] = {"failure_rate": bound, "failure_rate_alone": 1.0}
    RunFolder(run).write_manifest(manifest)
    RunFolder(run).results.unlink()  # they are of the manifest before
    result = run_command("report", run)
    assert result.code == code, result.err
    assert f"{word}  failures, speedy: " in result.out
    assert "PASS  failures without the non-ego, speedy: " in result.out
    written = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert (written["accepted"], written["exit_code"]) == (code == 0, code)
    assert [each["passed"] for each in written["acceptance"]] == [code == 0, True]
    cases = [case for suite in JUnitXml.fromfile(run / "junit.xml") for case in suite]
    failed = [case.classname for case in cases if not case.is_passed]
    assert failed == ([] if code == 0 else ["acceptance.speedy.failure_rate"])


# --- replays ----------------------------------------------------------------------------------------------------------


def test_replay__lists_a_page_of_the_games_of_an_arm_or_an_outcome(run_command: Callable[..., Result]) -> None:
    result = run_command("replay", learned_run(), "naive_alone", "--rows", 3, "--page", 2)
    assert result.code == 0
    assert "page 2 of 2, 4 games" in result.out
    assert "harness replay RUN ARM EPISODE" in result.out
    listed = re.compile(r"^ *(\w+(?:_alone|_vs_)\w*) ", flags=re.MULTILINE)
    assert listed.findall(result.out) == ["naive_alone"]
    failures = run_command("replay", learned_run(), "--outcome", "failure", "--rows", 1000)
    outcomes = read_csv(learned_run() / "episodes.csv")["ego_outcome"]
    assert len(listed.findall(failures.out)) == outcomes.isin(FAILURES).sum()
    wrong = run_command("replay", learned_run(), "--outcome", "colision")
    assert (wrong.code, "did you mean 'collision'?" in wrong.err) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["naive_vs_spedy", "1"], ["naive_vs_spedy", "has no such arm", "'naive_vs_speedy'"]),
        (["naive_vs_speedy", "7"], ["naive_vs_speedy 7", "no such game", "0 to 3"]),
        (["naive_vs_speedy", "1", "--seed", "9"], ["seed 9"]),
        (["naive_vs_spedy", "--list"], ["'naive_vs_speedy'"]),
    ],
)
def test_replay__an_unknown_game_names_the_known_ones(
    arguments: list[str], words: list[str], run_command: Callable[..., Result]
) -> None:
    result = run_command("replay", learned_run(), *arguments)
    assert result.code == 2
    for word in words:
        assert word in result.err


# --- errors of SUMO and of the program --------------------------------------------------------------------------------


def test_main__an_error_of_sumo_is_one_message(
    run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise SimulationError("SUMO died")

    monkeypatch.setattr("harness.campaign.results.results.write_results", fail)
    result = run_command("report", learned_run())
    assert (result.code, result.err.strip()) == (FAILED, "SimulationError: SUMO died")


def test_commands_of_tests__are_forks_unless_a_test_changes_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    assert can_fork({})
    monkeypatch.setenv("HARNESS_OF_THIS_TEST", "set")
    assert not can_fork({})


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_campaign__ended_while_it_loads_its_modules_says_that_it_continues(
    number: signal.Signals, code: int, tmp_path: Path
) -> None:
    process = begin_program("campaign", "merge", "--out", tmp_path / "run")
    wait_for(lambda: caught_by(process.pid) >> (signal.SIGHUP - 1) & 1, "the handlers of the signals")
    process.send_signal(number)
    assert_interrupted(process, code)
    assert not (tmp_path / "run").exists()


@pytest.fixture
def signal_is_default() -> Iterator[None]:
    """SIGTERM is handled by nobody, so that the command handles it; what handled it before does so again afterwards."""
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGTERM, before)


def test_main__interrupted_during_an_import_ends_after_it(
    run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, signal_is_default: None, tmp_path: Path
) -> None:
    (tmp_path / "loaded_late.py").write_text(
        "import signal\ntry:\n    signal.raise_signal(signal.SIGTERM)\nexcept KeyboardInterrupt:\n    lost = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)

    def run() -> None:
        assert not hasattr(importlib.import_module("loaded_late"), "lost")
        time.sleep(60.0)

    monkeypatch.setattr("harness.cli.app.run", run)
    assert run_command("campaign", "merge") == (143, "", f"{CONTINUES}\n")


def test_main__interrupted_while_a_function_is_compiled_ends_after_it(
    run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, signal_is_default: None
) -> None:
    def run() -> None:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        module = llvm.parse_assembly("define i32 @one() { ret i32 1 }")
        engine = llvm.create_mcjit_compiler(module, llvm.Target.from_default_triple().create_target_machine())
        engine.set_object_cache(lambda *_: signal.raise_signal(signal.SIGTERM))
        engine.finalize_object()
        time.sleep(60.0)

    monkeypatch.setattr("harness.cli.app.run", run)
    assert run_command("campaign", "merge") == (143, "", f"{CONTINUES}\n")


def test_main__an_error_while_it_ends_is_not_hidden(monkeypatch: pytest.MonkeyPatch, signal_is_default: None) -> None:
    def run() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            raise ZeroDivisionError

    monkeypatch.setattr("harness.cli.app.run", run)
    with pytest.raises(ZeroDivisionError):
        main()


def caught_by(pid: int) -> int:
    """The signals that a process handles, a bit for each."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    return int(re.findall(r"^SigCgt:\t(\w+)", status, re.MULTILINE)[0], 16)


def test_command__that_keeps_no_work_says_only_that_it_was_interrupted(
    run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, signal_is_default: None
) -> None:
    monkeypatch.setattr("harness.cli.documents.check_scene", lambda *_: signal.raise_signal(signal.SIGTERM))
    assert run_command("check", "networks/merge") == (143, "", f"{INTERRUPTED}\n")


@pytest.mark.parametrize("arguments", [("campaign", "merge"), ("report", "nowhere")])
def test_command__with_too_little_address_space_is_refused(
    arguments: tuple[str, ...], run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("resource.getrlimit", lambda kind: (1_600_000 * 1024, resource.RLIM_INFINITY))
    code, out, err = run_command(*arguments)
    assert (code, out, len(err.splitlines())) == (USAGE_ERROR, "", 1)
    assert err.startswith("ulimit -v: 1600000 kB: is too little address space")


@pytest.mark.parametrize(
    ("limit_bytes", "remedy"),
    [
        (
            resource.RLIM_INFINITY,
            "(end other programs, or run fewer stages at once with --jobs); finished work is kept",
        ),
        (
            3 * 10**9,
            "(each process may use 3.0 GB of address space: raise this limit, ulimit -v); finished work is kept",
        ),
    ],
)
def test_main__without_memory_the_message_is_a_whole_sentence(
    limit_bytes: int, remedy: str, run_command: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("harness.campaign.results.results.write_results", fail)
    monkeypatch.setattr("resource.getrlimit", lambda kind: (limit_bytes, limit_bytes))
    expected = f"the machine is short of memory: no more could be allocated {remedy}\n"
    assert run_command("report", learned_run()) == (FAILED, "", expected)


def test_main__a_bug_has_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def bug(*_: object) -> None:
        raise KeyError("a bug")

    monkeypatch.setattr("harness.campaign.results.results.write_results", bug)
    monkeypatch.setattr("sys.argv", ["harness", "report", str(learned_run())])
    with pytest.raises(KeyError, match="a bug"):
        main()
