"""Holds the cut of the package: who may import whom, what files are called, and how long they get."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGE = REPOSITORY / "harness"

# Which part (a module or a folder directly under harness/) may import which others. The parts stand in the
# order of the design: what a campaign is made of first, what runs it last. Not every part may import all
# that stand above it, and a new arrow is a decision: it is drawn here first. The table has no cycle.
# "harness" is the public face, harness/__init__.py: nothing inside may import from it.
ALLOWED: dict[str, set[str]] = {
    "errors": set(),
    "files": set(),
    "versions": set(),
    "locking": set(),
    "attempts": set(),
    "file_content": set(),
    "compiling": set(),
    "game": {"compiling"},
    "documents": {"errors", "file_content", "game"},  # game: payoff terms and what a persona is made of
    "traffic": {"errors", "file_content", "documents", "game"},
    "policy_file": {"errors", "files", "file_content", "documents", "game"},
    "drivers": {"errors", "documents", "game", "policy_file"},
    "arena": {"errors", "documents", "game", "traffic", "drivers"},
    "mixture": {"documents", "drivers", "game"},
    "conformance": {"errors", "game", "traffic", "drivers", "arena"},
    "environments": {"errors", "documents", "game", "traffic", "drivers", "policy_file", "arena"},
    "next_games": {"game", "traffic", "arena"},
    "vector_environment": {"game", "policy_file", "arena", "next_games"},
    "convergence": set(),
    "checkpoint": {"files", "policy_file"},
    "training": {
        *("errors", "documents", "game", "traffic", "drivers", "policy_file"),
        *("arena", "mixture", "vector_environment", "checkpoint", "convergence"),
    },
    "metrics": {"game"},
    "paired_games": {"documents", "game", "traffic", "drivers", "arena", "mixture"},
    "reconfiguration": {"errors", "files", "documents", "game", "traffic", "drivers", "mixture", "paired_games"},
    "search_columns": set(),
    "assessment": {"errors", "documents", "game", "traffic", "arena", "mixture", "metrics"},
    "trace_file": {"errors", "files", "file_content", "game"},
    "seals": {"files", "file_content"},
    "questions": set(),
    "comparison": {"questions"},
    "theory": {"errors", "comparison"},
    # theory, search_columns: what their tables' columns are
    "tables": {"errors", "files", "file_content", "comparison", "theory", "search_columns"},
    "summary": {"comparison", "tables"},
    "reconfigured": {
        *("errors", "files", "documents", "drivers", "attempts", "tables", "search_columns", "reconfiguration"),
    },
    "rounds": {"documents", "game", "questions"},
    "responses": {"documents", "game", "rounds"},
    "exchange": {"documents", "game", "rounds", "plan_searches", "responses"},
    "plan_searches": {"documents", "rounds"},
    "plan": {"documents", "rounds", "responses", "exchange", "plan_searches"},
    "plan_names": {"errors", "documents", "rounds", "responses", "plan"},
    "pairings": {"documents", "game", "rounds", "responses", "exchange", "plan", "theory"},
    "preflight": {"errors", "documents", "game", "traffic", "policy_file", "drivers", "rounds", "plan", "plan_names"},
    "run_folder": {"errors", "files", "file_content", "documents", "rounds", "locking", "seals"},
    "series": {"game"},
    "manoeuvres": {"game", "series"},
    "populations": {"documents", "game", "assessment", "tables", "summary"},
    "manoeuvre_file": {"traffic", "manoeuvres", "tables", "run_folder", "trace_file"},
    "segments": {
        *("files", "assessment", "trace_file", "tables", "seals", "versions", "attempts", "manoeuvre_file"),
    },
    "conditions": {"documents", "drivers", "preflight", "rounds", "run_folder"},
    "stage_keys": {"policy_file", "preflight", "responses", "rounds", "versions"},
    "settling": {"rounds", "run_folder", "tables", "theory"},
    "casting": {
        *("errors", "documents", "game", "traffic", "drivers", "policy_file", "mixture", "assessment", "tables"),
        *("rounds", "run_folder", "conditions", "theory", "reconfigured"),
    },
    "stages": {
        *("errors", "files", "game", "traffic", "policy_file", "convergence", "training", "mixture"),
        *("assessment", "segments", "tables", "rounds", "responses", "run_folder", "manoeuvre_file"),
        *("attempts", "versions", "conditions", "settling", "casting", "reconfiguration", "reconfigured"),
    },
    "deaths": {"rounds", "attempts"},
    "workers": {
        *("errors", "files", "rounds", "locking", "run_folder", "attempts", "deaths", "conditions", "stages"),
    },
    "reports": {"errors", "comparison", "theory", "tables", "search_columns", "manoeuvres"},
    "replay": {"errors", "game", "traffic"},  # traffic: SUMO-GUI, steered
    "recorded_games": {"game", "traffic", "series", "trace_file", "reports", "replay"},
    "model_card": {"errors", "documents", "files", "game", "policy_file", "reports", "plan", "rounds", "run_folder"},
    "watching": {
        *("errors", "documents", "traffic", "replay", "rounds", "run_folder", "tables", "trace_file", "manoeuvres"),
    },
    "progress": {"rounds", "workers"},
    "schema_files": {"errors", "files", "documents"},
    "persona_template": {"errors", "documents", "game", "plan"},
    "portraits": {"errors", "files", "documents", "game", "reports"},  # reports: the style of its figures and pages
    "run_results": {
        *("errors", "files", "documents", "traffic", "questions", "comparison", "tables", "summary", "rounds"),
        *("run_folder", "reports", "replay", "trace_file", "recorded_games", "manoeuvre_file", "model_card"),
        *("pairings", "populations", "search_columns", "theory"),
    },
    "campaign_run": {
        *("documents", "preflight", "plan", "rounds", "run_folder", "conditions", "stage_keys", "workers", "progress"),
        *("reports", "run_results", "versions"),
    },
}
ALLOWED["cli_documents"] = set(ALLOWED)
ALLOWED["cli"] = set(ALLOWED)
ALLOWED["__main__"] = {"cli"}
ALLOWED["harness"] = set(ALLOWED) - {"cli", "cli_documents", "__main__"}

SUMO = {"libsumo", "sumo", "sumolib", "traci"}
LEARNERS = {"torch", "stable_baselines3"}
GAME_MAY_IMPORT = {
    "__future__",
    "abc",
    "bisect",
    "collections",
    "dataclasses",
    "enum",
    "functools",
    "harness",
    "hashlib",
    "itertools",
    "math",
    "numpy",
    "operator",
    "typing",
}
FILE_ACCESS_CALLS = {
    "fromfile",
    "genfromtxt",
    "load",
    "loadtxt",
    "memmap",
    "open",
    "save",
    "savetxt",
    "savez",
    "tofile",
}

FORBIDDEN_WORDS = {"utils", "helpers", "common", "base", "core", "manager", "handler", "misc"}
LONGEST = {".py": 300, ".jinja": 400, ".css": 400, ".js": 400}
SEEDED_RANDOMNESS = {"Generator", "BitGenerator", "SeedSequence", "PCG64", "Philox", "default_rng"}

SOURCES = sorted(PACKAGE.rglob("*.py"))


def label(path: Path) -> str:
    return path.relative_to(REPOSITORY).as_posix()


each_source = pytest.mark.parametrize("path", SOURCES, ids=label)


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def part_of(path: Path) -> str:
    """The module or folder directly under harness/ that a file belongs to; "harness" for its __init__."""
    first = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    return "harness" if first == "__init__" else first


def is_module(dotted: str) -> bool:
    path = REPOSITORY.joinpath(*dotted.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def imported_modules(tree: ast.AST, path: Path) -> Iterator[str]:
    """Every absolute module name that a file imports anywhere, functions and TYPE_CHECKING included."""
    package = path.relative_to(REPOSITORY).parent.parts
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            origin = ".".join(filter(None, (above, node.module)))
            for alias in node.names:
                deeper = f"{origin}.{alias.name}"
                yield deeper if origin.split(".")[0] == "harness" and is_module(deeper) else origin


def imported_packages(path: Path) -> set[str]:
    return {module.split(".")[0] for module in imported_modules(tree_of(path), path)}


def imported_parts(path: Path) -> set[str]:
    """The other parts of the harness that a file imports."""
    modules = [module.split(".") for module in imported_modules(tree_of(path), path)]
    parts = {module[1] if len(module) > 1 else "harness" for module in modules if module[0] == "harness"}
    return parts - {part_of(path)}


def graph() -> dict[str, set[str]]:
    arrows: dict[str, set[str]] = {part_of(path): set() for path in SOURCES}
    for path in SOURCES:
        arrows[part_of(path)] |= imported_parts(path)
    return arrows


def reached_from(part: str) -> set[str]:
    """A part and all that it imports through the harness, however far away."""
    arrows, seen, waiting = graph(), set[str](), [part]
    while waiting:
        current = waiting.pop()
        if current not in seen:
            seen.add(current)
            waiting.extend(arrows.get(current, ()))
    return seen


# --- import direction ---


@each_source
def test_imports__only_along_the_arrows_of_the_design(path: Path) -> None:
    part = part_of(path)
    assert part in ALLOWED, f"harness/{part} is not in the table ALLOWED: give it its place there"
    not_allowed = imported_parts(path) - ALLOWED[part]
    assert not not_allowed, f"{part} may not import {sorted(not_allowed)}"


@pytest.mark.parametrize("arrows", [ALLOWED, graph()], ids=["table", "package"])
def test_imports__run_in_no_circle(arrows: dict[str, set[str]]) -> None:
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        pytest.fail("imports run in a circle: " + " -> ".join(error.args[1]))


@each_source
def test_imports__only_traffic_imports_sumo(path: Path) -> None:
    if part_of(path) != "traffic":
        assert not imported_packages(path) & SUMO


@pytest.mark.parametrize("path", [path for path in SOURCES if part_of(path) == "game"], ids=label)
def test_game__is_pure_numpy(path: Path) -> None:
    assert imported_packages(path) <= GAME_MAY_IMPORT


@pytest.mark.parametrize("path", [path for path in SOURCES if part_of(path) == "game"], ids=label)
def test_game__opens_no_files(path: Path) -> None:
    calls = [node.func for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call)]
    names = {ast.unparse(call).split(".")[-1] for call in calls}
    assert not names & FILE_ACCESS_CALLS


@pytest.mark.parametrize("part", ["comparison", "theory", "reports"])
def test_judging__reaches_neither_sumo_nor_a_learner(part: str) -> None:
    reached = reached_from(part)
    guilty = {
        label(path): found
        for path in SOURCES
        if part_of(path) in reached and (found := imported_packages(path) & (SUMO | LEARNERS))
    }
    assert not guilty


@pytest.mark.parametrize("part", ["comparison", "theory", "reports"])
def test_judging__loads_neither_sumo_nor_a_learner(part: str) -> None:
    if not any(part_of(path) == part for path in SOURCES):
        pytest.skip(f"there is no harness.{part}")
    modules = [
        ".".join(path.relative_to(REPOSITORY).with_suffix("").parts).removesuffix(".__init__")
        for path in SOURCES
        if part_of(path) == part
    ]
    assert loaded_with(*modules).isdisjoint(SUMO | LEARNERS)


def test_checking__loads_no_learner_and_no_statistics() -> None:
    """`harness check` is run often, and these take longer to load than all it does."""
    loaded = loaded_with("harness.preflight")
    assert "numpy" in loaded
    assert loaded.isdisjoint(LEARNERS | {"pandas", "scipy.stats", "plotly", "optuna"})


def loaded_with(*modules: str) -> set[str]:
    program = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split())


# --- names, docstrings, length ---


@each_source
def test_module__says_what_it_is(path: Path) -> None:
    assert (ast.get_docstring(tree_of(path)) or "").strip(), "no docstring"


@each_source
def test_names__say_something(path: Path) -> None:
    words = {word for name in path.relative_to(PACKAGE).with_suffix("").parts for word in name.split("_")}
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ClassDef):
            words |= {word.lower() for word in re.findall(r"[A-Z][a-z0-9]*", node.name)}
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            words.add(node.name.strip("_"))
    assert not words & FORBIDDEN_WORDS


@pytest.mark.parametrize("path", sorted(path for path in PACKAGE.rglob("*") if path.suffix in LONGEST), ids=label)
def test_file__stays_short(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= LONGEST[path.suffix], "a file this long is looking for its second noun"


# --- randomness ---


def global_randomness(tree: ast.AST) -> Iterator[str]:
    """What a file uses of `random` or of NumPy's global random state, as text."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name == "random")
        elif isinstance(node, ast.ImportFrom) and node.module == "random" and not node.level:
            yield "random"
        elif isinstance(node, ast.ImportFrom) and node.module == "numpy.random":
            yield from (alias.name for alias in node.names if alias.name not in SEEDED_RANDOMNESS)
        elif (
            isinstance(node, ast.Attribute)
            and node.attr not in SEEDED_RANDOMNESS
            and ast.unparse(node.value) in ("np.random", "numpy.random")
        ):
            yield ast.unparse(node)


@each_source
def test_randomness__comes_from_a_generator_argument(path: Path) -> None:
    assert list(global_randomness(tree_of(path))) == []


# --- the test's own eyes ---


@pytest.mark.parametrize(
    "source",
    ["import random", "from numpy.random import rand", "import numpy as np\nnp.random.shuffle([1])"],
)
def test_randomness__a_global_source_is_seen(source: str) -> None:
    assert list(global_randomness(ast.parse(source)))


def test_randomness__a_generator_is_not_taken_for_a_global_source() -> None:
    source = "import numpy as np\ndef draw(random: np.random.Generator): return np.random.default_rng(1)"
    assert list(global_randomness(ast.parse(source))) == []


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("def f():\n    import libsumo", "libsumo"),
        ("from harness import game", "harness.game"),
        ("from harness import __version__", "harness"),
        ("from . import quantities", "harness.game.quantities"),
        ("from ..errors import HarnessError", "harness.errors"),
        ("from .. import errors", "harness.errors"),
    ],
)
def test_imports__every_form_is_seen(source: str, module: str) -> None:
    assert list(imported_modules(ast.parse(source), PACKAGE / "game" / "payoff.py")) == [module]
