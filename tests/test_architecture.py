"""The rooms of the package: which may import which, what files are called, how long they get.

Each test checks every file and reports all violations at once.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.support.repository import PACKAGE, REPOSITORY, SOURCES, label, slow_tests, tree_of

# Which room may import which others, from the lowest floor to the highest. A room is a module or folder directly under
# harness/, or a folder in one that has a line of its own. A new arrow is a decision: add it here first.
# "harness" is the public face, harness/__init__.py: no room imports it.
GROUND = {"errors", "files", "version", "wording", "shipped_documents", "game", "config"}
EVALUATION = {"evaluation", "evaluation.comparisons", "evaluation.game_theory"}
ROAD = {"road.xml", "road.net", "road.demand", "road.scene"}
CAMPAIGN = {"campaign", "campaign.plan", "campaign.storage", "campaign.execution", "campaign.results"}
ROOMS: dict[str, set[str]] = {
    "errors": set(),
    "files": {"errors"},
    "version": set(),
    "wording": set(),
    "shipped_documents": {"errors"},
    "game": set(),
    "config": {"errors", "files", "game"},
    "evaluation": {"errors", "files", "wording", "game"},
    "evaluation.comparisons": {"errors", "files", "game", "evaluation"},
    "evaluation.game_theory": {"errors", "files", "game", "evaluation", "evaluation.comparisons"},
    "drivers": GROUND,
    "reports": GROUND | EVALUATION,
    "road": set(),
    "road.xml": GROUND,
    "road.net": GROUND | {"road.xml"},
    "road.demand": GROUND | {"road.xml", "road.net"},
    "road.scene": GROUND | {"road.xml", "road.net", "road.demand"},
    "maps": GROUND | {"road.xml", "road.net", "road.demand"},
    "sumo": GROUND | ROAD,
    "replay": {"errors", "files", "game", "sumo"} | ROAD | EVALUATION,
    "export": {"errors", "files", "game", "replay"} | ROAD | EVALUATION,
    "environments": GROUND | ROAD | EVALUATION | {"drivers", "sumo"},
    "assessment": GROUND | ROAD | EVALUATION | {"drivers", "sumo", "environments"},
    "training": GROUND | ROAD | {"drivers", "environments"},
    "campaign.plan": {"errors", "wording", "game", "config"} | EVALUATION,
    "campaign.storage": {"errors", "files", "version", "config", "campaign.plan"}
    | EVALUATION
    | {"road.scene", "environments"},
    "campaign": GROUND | {"road.scene", "drivers", "evaluation", "campaign.plan"},  # preflight; names of strategies
    "campaign.results": GROUND
    | {"road.net", "road.scene", "drivers", "environments", "replay", "export", "reports"}
    | {"campaign.plan", "campaign.storage"}
    | EVALUATION,
    "campaign.execution": GROUND
    | {"road.scene", "drivers", "assessment", "reports", "training"}
    | EVALUATION
    | CAMPAIGN,
    "cli": GROUND  # of evaluation: the planned tests, and tables
    | {"road.net", "road.scene", "maps", "drivers", "assessment", "evaluation", "export", "reports"}
    | CAMPAIGN,
    "library": GROUND | {"drivers"} | EVALUATION | CAMPAIGN,
    "__main__": {"cli"},
    "harness": GROUND | {"road.scene", "drivers", "environments", "library"},
}
SUMO = {"libsumo", "sumo", "sumolib", "traci"}
LEARNERS = {"torch", "stable_baselines3"}
PURE = (*sorted(EVALUATION), "reports")
"""Rooms that judge: they neither import nor load SUMO or a learner."""
GAME_MAY_IMPORT = {
    *("__future__", "abc", "bisect", "collections", "dataclasses", "enum", "functools", "harness", "hashlib"),
    *("itertools", "math", "numpy", "operator", "typing"),
}
JIT_MAY_IMPORT = GAME_MAY_IMPORT | {
    "atexit",
    "contextlib",
    "filelock",
    "logging",
    "numba",
    "os",
    "pathlib",
    "platformdirs",
    "threading",
}
FILE_ACCESS_CALLS = {
    *("fromfile", "genfromtxt", "load", "loadtxt", "memmap", "open", "save", "savetxt", "savez", "tofile")
}
FORBIDDEN_WORDS = {"utils", "helpers", "common", "base", "core", "manager", "handler", "misc"}
LONGEST = {".py": 350, ".jinja": 400, ".css": 400, ".js": 400}
MOST_FLOORS, MOST_IMPORTS, MOST_NAMES = 8, 25, 4
TESTS = sorted((REPOSITORY / "tests").rglob("*.py"))
SEEDED_RANDOMNESS = {"Generator", "BitGenerator", "SeedSequence", "PCG64", "Philox", "default_rng"}


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(REPOSITORY).with_suffix("").parts).removesuffix(".__init__")


def room_of(module: str) -> str:
    """The room of a dotted module of the harness."""
    parts = module.split(".")[1:]
    if ".".join(parts[:2]) in ROOMS:
        return ".".join(parts[:2])
    return parts[0] if parts else "harness"


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
                yield deeper if origin.split(".")[0] in ("harness", "tests") and is_module(deeper) else origin


def imported_packages(path: Path) -> set[str]:
    return {module.split(".")[0] for module in imported_modules(tree_of(path), path)}


def imported_from_harness(path: Path) -> set[str]:
    modules = imported_modules(tree_of(path), path)
    return {module for module in modules if module.split(".")[0] == "harness"} - {module_of(path)}


def in_room(room: str) -> list[Path]:
    return [path for path in SOURCES if room_of(module_of(path)) == room]


def reached_from(room: str) -> set[str]:
    """A room and all rooms that it imports, directly or through others."""
    seen, waiting = set[str](), [room]
    while waiting:
        current = waiting.pop()
        if current not in seen:
            seen.add(current)
            waiting += [room_of(module) for path in in_room(current) for module in imported_from_harness(path)]
    return seen


# --- import direction ---


def test_imports__only_along_the_table_of_rooms() -> None:
    wrong = [
        f"{label(path)} imports {module}"
        for path in SOURCES
        for module in sorted(imported_from_harness(path))
        if room_of(module) not in ROOMS[room_of(module_of(path))] | {room_of(module_of(path))}
    ]
    assert not wrong


@pytest.mark.parametrize("graph", ["rooms", "modules"])
def test_imports__run_in_no_circle(graph: str) -> None:
    arrows = {
        "rooms": {room: allowed - {room} for room, allowed in ROOMS.items()},
        "modules": {module_of(path): imported_from_harness(path) for path in SOURCES},
    }
    try:
        TopologicalSorter(arrows[graph]).prepare()
    except CycleError as error:
        pytest.fail("imports run in a circle: " + " -> ".join(error.args[1]))


def test_imports__only_road_maps_and_sumo_import_sumo() -> None:
    outside = [path for path in SOURCES if room_of(module_of(path)) not in {*ROAD, "maps", "sumo"}]
    assert [label(path) for path in outside if imported_packages(path) & SUMO] == []
    without = [path for path in SOURCES if room_of(module_of(path)) != "sumo"]
    assert [label(path) for path in without if "libsumo" in imported_packages(path)] == []


def floors(room: str) -> dict[str, int]:
    """The floor of each module of a room: 1 if it imports no other module of the room."""
    modules = {module_of(path): path for path in in_room(room)}
    inside = {name: imported_from_harness(path) & modules.keys() for name, path in modules.items()}
    found: dict[str, int] = {}
    for name in TopologicalSorter(inside).static_order():
        found[name] = 1 + max((found[each] for each in inside[name]), default=0)
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_room__has_few_floors_inside(room: str) -> None:
    assert {name: floor for name, floor in floors(room).items() if floor > MOST_FLOORS} == {}


def test_game__is_pure_numpy_and_opens_no_files() -> None:
    """But for `jit`, which stores compiled code."""
    wrong = []
    for path in in_room("game"):
        jit = path.stem == "jit"
        wrong += [
            (label(path), each) for each in imported_packages(path) - (JIT_MAY_IMPORT if jit else GAME_MAY_IMPORT)
        ]
        calls = [node.func for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call)]
        names = {ast.unparse(call).split(".")[-1] for call in calls}
        wrong += [(label(path), each) for each in names & FILE_ACCESS_CALLS if not jit]
    assert wrong == []


@pytest.mark.parametrize("room", PURE)
def test_judging__reaches_and_loads_neither_sumo_nor_a_learner(room: str) -> None:
    reached = [path for each in reached_from(room) for path in in_room(each)]
    assert {label(path): found for path in reached if (found := imported_packages(path) & (SUMO | LEARNERS))} == {}
    assert loaded_with(*map(module_of, in_room(room))).isdisjoint(SUMO | LEARNERS)


def test_checking__loads_no_learner_and_no_statistics() -> None:
    """`harness check` is run often, and these take longer to load than all it does."""
    loaded = loaded_with("harness.campaign.preflight")
    assert "numpy" in loaded
    assert loaded.isdisjoint(LEARNERS | {"pandas", "scipy.stats", "optuna"})


def test_help__loads_no_numerics() -> None:
    """Help and the completion of a shell answer at once."""
    assert loaded_with("harness.cli.app").isdisjoint(LEARNERS | {"numpy", "numba", "pandas", "pydantic", "sumolib"})


def test_resuming__loads_no_learner_and_no_statistics() -> None:
    """A campaign that is finished is looked through and left as it is; one that is not says so before it loads them."""
    loaded = loaded_with("harness.campaign.execution.run_campaign")
    assert loaded.isdisjoint(LEARNERS | {"pandas", "scipy.stats", "scipy.optimize", "matplotlib", "optuna"})


def loaded_with(*modules: str) -> set[str]:
    program = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split())


def test_tests__no_test_module_imports_another() -> None:
    """What several of them use is in tests/support."""
    wrong = [
        f"{label(path)} imports {module}"
        for path in TESTS
        for module in sorted(set(imported_modules(tree_of(path), path)))
        if module.split(".")[-1].startswith("test_") and module.split(".")[0] == "tests"
    ]
    assert wrong == []


def test_slow_tests__each_line_names_a_test_and_every_room_keeps_fast_ones() -> None:
    """Of tests/slow_tests.txt, which says what `make test` leaves out."""
    tests = {path: names for path in TESTS if path.stem.startswith("test_") and (names := set(functions_of(path)))}
    known = {label(path) for path in tests} | {
        f"{label(path)}::{name}" for path, names in tests.items() for name in names
    }
    assert sorted(slow_tests() - known) == []
    fast = {path for path, names in tests.items() if label(path) not in slow_tests() and names - slow_in(path)}
    folders = {path.relative_to(REPOSITORY / "tests").parts[0] for path in fast}
    modules = {"library", "errors", "files", "version", "wording", "shipped_documents", "harness", "__main__"}
    assert {room.split(".")[0] for room in ROOMS} - modules <= folders


def functions_of(path: Path) -> list[str]:
    return [node.name for node in tree_of(path).body if isinstance(node, ast.FunctionDef) and node.name[:5] == "test_"]


def slow_in(path: Path) -> set[str]:
    return {line.partition("::")[2] for line in slow_tests() if line.startswith(f"{label(path)}::")}


# --- names, docstrings, length ---


def test_modules__each_says_what_it_is() -> None:
    assert [label(path) for path in SOURCES if not (ast.get_docstring(tree_of(path)) or "").strip()] == []


def test_names__say_something() -> None:
    assert {label(path): found for path in SOURCES if (found := words_of(path) & FORBIDDEN_WORDS)} == {}


def words_of(path: Path) -> set[str]:
    words = {word for name in path.relative_to(PACKAGE).with_suffix("").parts for word in name.split("_")}
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ClassDef):
            words |= {word.lower() for word in re.findall(r"[A-Z][a-z0-9]*", node.name)}
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            words.add(node.name.strip("_"))
    return words


def test_files__stay_short() -> None:
    """A file longer than this is looking for its second noun."""
    lengths = {
        path: len(path.read_text(encoding="utf-8").splitlines())
        for path in PACKAGE.rglob("*.*")
        if path.suffix in LONGEST
    }
    assert {label(path): lines for path, lines in lengths.items() if lines > LONGEST[path.suffix]} == {}


def test_files__import_from_few_places() -> None:
    """Without `from __future__`, which every file has."""
    counts = {
        label(path): sum(isinstance(node, ast.Import | ast.ImportFrom) for node in tree_of(path).body) - 1
        for path in SOURCES
    }
    assert {name: count for name, count in counts.items() if count > MOST_IMPORTS} == {}


def test_files__have_no_packed_lines() -> None:
    """No statement gives values to many names at once; `ruff format` sees to the rest."""
    packed = [
        f"{label(path)}:{node.lineno}"
        for path in SOURCES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple) and len(node.value.elts) > MOST_NAMES
        if any(isinstance(target, ast.Tuple) for target in node.targets)
    ]
    assert packed == []


def test_names__of_files_and_public_classes_are_used_once() -> None:
    files = Counter(path.stem for path in SOURCES if not path.stem.startswith("__"))
    classes = Counter(
        node.name
        for path in SOURCES
        for node in tree_of(path).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in (files + classes).items() if count > 1] == []


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


SB3_RANDOMNESS = {"harness/training/compiled_ppo.py": ["np.random.permutation"]}
"""Stable-Baselines3 shuffles by NumPy's global state, which its `set_random_seed` seeds; what replaces its update draws
the same minibatches."""


def test_randomness__comes_from_a_generator_argument() -> None:
    found = {label(path): used for path in SOURCES if (used := list(global_randomness(tree_of(path))))}
    assert found == SB3_RANDOMNESS


# --- the test's own eyes ---


@pytest.mark.parametrize(
    "source", ["import random", "from numpy.random import rand", "import numpy as np\nnp.random.shuffle([1])"]
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
