"""Opening a file never runs code: no document, policy or run folder can bring a program, and the report shows text."""

from __future__ import annotations

import ast
import os
import pickle
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd
import pytest

from tests.hostile.inputs import CARD, CHECK, TENSORS, write_project, write_run
from tests.support.chromium import launched, opener
from tests.support.pages import campaign, rendered
from tests.support.recorded import SCENE, manoeuvres, recorded
from tests.support.repository import SOURCES, label, tree_of
from tests.support.tiny import harness

# --- the source -------------------------------------------------------------------------------------------------------

UNPICKLERS = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "jsonpickle"}
READERS = {"yaml", "xml.dom", "xml.sax", "xml.dom.minidom", "lxml", "runpy", "code", "imp"}
CALLS = {"eval", "exec", "compile", "__import__", "execfile"}
METHODS = {"read_pickle", "loads_pickle", "unsafe_load", "full_load", "run_path", "run_module", "exec_module"}
# torch.load and PPO.load unpickle; numpy's does when it is told to
LOADERS = {"torch.load", "PPO.load", "np.load", "numpy.load", "joblib.load", "yaml.load"}
EXCEPTIONS = {
    # its stream is a pipe to a child that it started itself: no file, no address, nobody else's
    "harness/sumo/subprocess_simulation.py": {"pickle"},
    # VecNormalize saves pickles: read with the permission to run code alone (--allow-code)
    "harness/drivers/sb3_policy.py": {"pickle"},
    # its stream is a pipe to a child that it started itself
    "harness/assessment/repeated_game.py": {"pickle"},
    # hands on what Python itself found, when Gymnasium is imported
    "harness/__init__.py": {"exec_module"},
}


def what_could_run_code(tree: ast.AST) -> Iterator[str]:
    """The imports and calls in a file that can make code of data."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name in UNPICKLERS | READERS)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module in UNPICKLERS | READERS:
            yield str(node.module)
        elif isinstance(node, ast.Attribute) and (ast.unparse(node) in LOADERS or node.attr in METHODS):
            yield ast.unparse(node) if ast.unparse(node) in LOADERS else node.attr
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in CALLS:
                yield node.func.id
            for each in node.keywords:
                asked = each.arg in ("allow_pickle", "shell") or (each.arg == "weights_only")
                if asked and not (isinstance(each.value, ast.Constant) and each.value.value is False):
                    yield f"{each.arg}={ast.unparse(each.value)}"


def test_source__has_nothing_that_makes_code_of_data() -> None:
    found = {
        label(path): set(what_could_run_code(tree_of(path))) - EXCEPTIONS.get(label(path), set()) for path in SOURCES
    }
    assert {name: calls for name, calls in found.items() if calls} == {}


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from pickle import loads",
        "import torch\ntorch.load('x')",
        "PPO.load('x')",
        "pd.read_pickle('x')",
        "np.load('x')",
        "eval('1')",
        "exec(text)",
        "open_it(file, allow_pickle=True)",
        "subprocess.run(text, shell=True)",
        "import yaml",
        "from xml.dom import minidom",
    ],
)
def test_source__what_makes_code_of_data_is_seen(source: str) -> None:
    assert list(what_could_run_code(ast.parse(source)))


# --- files ------------------------------------------------------------------------------------------------------------


class _Bomb:
    """Makes a folder when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self._mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self._mark),)


def test_bomb__goes_off_when_it_is_unpickled(tmp_path: Path) -> None:
    pickle.loads(pickle.dumps(_Bomb(tmp_path / "mark")))
    assert (tmp_path / "mark").is_dir()


@pytest.mark.parametrize("file", [TENSORS, CARD])
def test_policy__that_is_a_pickle_does_not_go_off(file: str, tmp_path: Path) -> None:
    project = write_project(tmp_path)
    (project / file).write_bytes(pickle.dumps(_Bomb(tmp_path / "mark")))
    assert harness(CHECK[0], project / CHECK[1], cwd=tmp_path).returncode == 2
    assert not (tmp_path / "mark").exists()


def test_run_folder__none_of_its_files_goes_off(tmp_path: Path) -> None:
    run = write_run(tmp_path)
    bomb = pickle.dumps(_Bomb(tmp_path / "mark"))
    files = [path for path in sorted(run.rglob("*")) if path.is_file()]
    assert len(files) > 30
    for file in files:
        if file.name != "manifest.json":
            file.write_bytes(bomb)
    for command in (("report", run), ("replay", run, "--list"), ("replay", run, "naive_alone", "0")):
        assert harness(*command, cwd=tmp_path).returncode == 2
    (run / "manifest.json").write_bytes(bomb)
    assert harness("report", run, cwd=tmp_path).returncode == 2
    assert not (tmp_path / "mark").exists()


def test_folder__programs_that_lie_beside_documents_are_not_run(tmp_path: Path) -> None:
    project = write_project(tmp_path)
    program = f"import os; os.mkdir({str(tmp_path / 'mark')!r})"
    for folder in (tmp_path, project, *(each for each in project.rglob("*") if each.is_dir())):
        for name in ("sitecustomize", "usercustomize", "conftest", "numpy", "json", "libsumo", "harness", "tomllib"):
            (folder / f"{name}.py").write_text(program)
    done = harness(CHECK[0], project / CHECK[1], cwd=project / "campaigns")
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "mark").exists()


# --- the report -------------------------------------------------------------------------------------------------------

HOSTILE = (
    "<script>alert(1)</script>",
    "\"><img src=x onerror='alert(2)'>",
    "'-alert(3)-' onmouseover=alert(4) x='",
    "</script><script>alert(5)</script>",
    "</style><svg onload=alert(6)>",
    "--><iframe srcdoc='<script>alert(7)</script>'></iframe>",
    "{{ 7 * 7 }}{% raw %}${8 * 8}",
    "javascript:alert(9)",
    "&lt;b&gt;&#60;i&#62;",
    "line\u2028separator\u2029and\u202eturned\u202c\u0000end",
)
MARKS = {name: name for name in HOSTILE}
HARMLESS = tuple(f"plain{k}" for k in range(len(HOSTILE)))


class Shape(HTMLParser):
    """The elements of a page with the names of their attributes, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, tuple[str, ...]]] = []
        self.addresses: set[str] = set()
        self.text: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, tuple(name for name, _ in attributes)))
        self.addresses |= {str(value) for name, value in attributes if name in ("href", "src", "action", "data")}

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@cache
def page_of(names: tuple[str, ...]) -> str:
    """A report in which everything that a document or a run folder names is one of these texts."""
    arguments = campaign(personas=names[:2])
    manifest = arguments["manifest"]
    manifest |= {"name": names[2], "versions": {names[3]: names[4]}}
    manifest["campaign"] |= {"scene": names[5], "ego": {"driver": names[6]}}
    first, second = list(manifest["stages"])[:2]
    manifest["stages"][first] |= {"status": "failed", "message": names[7]}
    manifest["stages"][second] |= {"rule": names[8], "stopped": names[9]}
    episodes = arguments["episodes"].copy()
    rows = episodes.index[episodes["arm"] == "naive_alone"]
    episodes.loc[rows[0], ["error", "ego_outcome"]] = [names[9], "error"]
    told = manoeuvres(episodes)
    told.loc[told.index[0], ["manoeuvre", "text"]] = [names[0], names[1]]
    arguments["replays"] = [*arguments["replays"], names[3]]
    games = recorded(episodes)
    return rendered(**{**arguments, "episodes": episodes}, games=games, scene=SCENE, manoeuvres=told)


def test_report__what_data_says_makes_no_element_and_no_attribute() -> None:
    hostile, harmless = Shape(page_of(HOSTILE)), Shape(page_of(HARMLESS))
    assert pd.Series(hostile.elements).value_counts().to_dict() == pd.Series(harmless.elements).value_counts().to_dict()
    text = "".join(hostile.text)
    for name in (HOSTILE[0], HOSTILE[1], HOSTILE[2], HOSTILE[7]):
        assert name in text, "it is to be read as it was written"
    assert all(each.startswith("#") or each.endswith((".csv", ".json")) for each in hostile.addresses)


def test_report__runs_nothing_that_data_says_in_a_real_browser(tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    file.write_text(page_of(HOSTILE), encoding="utf-8")
    with launched() as browser, opener(browser, file) as open_page:
        page = open_page()
        for details in page.locator("details").all():
            details.locator(":scope > summary").click()
        page.wait_for_timeout(300)
        assert page.seen == []
        assert page.locator("iframe, svg[onload], img[onerror], [onmouseover]").count() == 0
        assert page.get_by_text(HOSTILE[2], exact=False).count() > 0
