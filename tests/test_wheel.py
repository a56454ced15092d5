"""The wheel, installed in an environment of its own: everything that a user meets works without the checkout."""

from __future__ import annotations

import ast
import importlib.metadata
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path
from typing import get_args

import pandas as pd
import pytest
import yaml

from harness.errors import NOT_ACCEPTED
from harness.shipped_documents import Kind, shipped_names, shipped_policies
from tests.support.repository import REPOSITORY, SOURCES, tree_of
from tests.support.shipped import FOLDER, NAIVE_BY_NAME, PERSON_BY_NAME, RETRAINED, SPEEDY, TWO_GAMES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DISTRIBUTION = "safedriverl-harness"
USER_TEST = """
import harness

def test_my_ego_drives_alone():
    results = harness.run("games.toml", jobs=1)
    assert results.complete
    assert results.summary.set_index("arm")["failure_rate"]["naive_alone"] <= 0.5
"""


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a virtual environment with the wheel: a new one, beside the libraries that the tests run with,
    or the one that HARNESS_WHEEL_ENVIRONMENT names, which `make wheel` makes of any Python."""
    if named := os.environ.get("HARNESS_WHEEL_ENVIRONMENT"):
        return Path(named).absolute()
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", folder, REPOSITORY]
    subprocess.run(build, check=True, timeout=300)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True, timeout=300)
    (packages,) = (folder / "venv" / "lib").glob("python*/site-packages")
    # Only the folder of the libraries: an editable installation in it is a .pth file, which counts in no other folder.
    (packages / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    install = [
        *pip,
        "--python",
        folder / "venv" / "bin" / "python",
        "install",
        "--no-deps",
        "--ignore-installed",
        wheel,
    ]
    subprocess.run(install, check=True, timeout=300)
    return folder / "venv"


def run(
    environment: Path, folder: Path, program: str, *arguments: str, expected: int = 0, **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run a program of the environment in a folder, with no path to the checkout."""
    inherited = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    variables = inherited | variables
    variables["NUMBA_CACHE_DIR"] = str(environment / "compiled")  # of no use to anything else
    command = [environment / "bin" / program, *arguments]
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, timeout=600)
    assert done.returncode == expected, done.stdout + done.stderr
    return done


def python(environment: Path, folder: Path, code: str) -> str:
    return run(environment, folder, "python", "-c", code).stdout.strip()


def test_wheel__has_every_shipped_document_and_is_typed(environment: Path, tmp_path: Path) -> None:
    package = Path(python(environment, tmp_path, "import harness; print(harness.__file__)")).parent
    assert package.is_relative_to(environment)
    assert (package / "py.typed").is_file()
    for kind in get_args(Kind):
        there = sorted(each.stem for each in (package / "shipped" / kind).iterdir() if each.name != "README.md")
        assert [name for name in there if name != "examples"] == shipped_names(kind)
    policies = (package / "shipped" / "policies").rglob("policy.safetensors")
    assert sorted(f"{each.parts[-3]}/{each.parts[-2]}" for each in policies) == shipped_policies()


def test_wheel__shipped_policies_have_names(environment: Path, tmp_path: Path) -> None:
    other = {"other": PERSON_BY_NAME, "other_persona": SPEEDY}
    code = f"gymnasium.make('harness:harness/Ego-v0', scene={FOLDER!r}, **{other}).reset(seed=1)"
    python(environment, tmp_path, f"import gymnasium; {code}")
    campaign = TWO_GAMES.replace("[ego]", f'[ego]\ndriver = "{NAIVE_BY_NAME}"')
    (tmp_path / "named.toml").write_text(campaign, encoding="utf-8")
    run(environment, tmp_path, "harness", "check", "named.toml")


def test_wheel__the_command_says_its_version(environment: Path, tmp_path: Path) -> None:
    version = python(environment, tmp_path, f"import importlib.metadata as m; print(m.version({DISTRIBUTION!r}))")
    assert run(environment, tmp_path, "harness", "--version").stdout == f"harness {version}\n"


def test_wheel__a_new_project_is_in_order_and_shipped_campaigns_have_names(environment: Path, tmp_path: Path) -> None:
    run(environment, tmp_path, "harness", "new", "lab")
    lab = tmp_path / "lab"
    assert sorted(each.name for each in lab.iterdir()) == ["README.md", "campaign.toml", "networks", "personas"]
    assert "5 trainings" in run(environment, lab, "harness", "check", "campaign.toml").stdout
    run(environment, lab, "harness", "check", "demo")
    run(environment, lab, "harness", "persona", "show", "my_driver")


def test_wheel__plays_a_campaign_with_the_shipped_policies(environment: Path, tmp_path: Path) -> None:
    (tmp_path / "games.toml").write_text(TWO_GAMES, encoding="utf-8")
    told = json.loads(run(environment, tmp_path, "harness", "campaign", "games.toml", "--json", "--jobs", "1").stdout)
    assert (told["exit_code"], told["failed_stages"], told["error_games"]) == (0, [], 0)
    assert (tmp_path / "reports" / "two_games" / "report.html").is_file()
    # the test that a user writes, on the same run folder
    (tmp_path / "test_mine.py").write_text(USER_TEST, encoding="utf-8")
    run(environment, tmp_path, "python", "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_mine.py")


# --- the workflow for the repository of an ego -----------------------------------------------------------------------

WORKFLOW = REPOSITORY / "docs" / "ci" / "harness.yml"


def test_workflow__its_actions_have_versions() -> None:
    used = re.findall(r"uses: (\S+)", WORKFLOW.read_text(encoding="utf-8"))
    assert len(used) == 3
    assert [each for each in used if not re.fullmatch(r"actions/[\w-]+@v\d+", each)] == []


def test_workflow__each_of_its_commands_does_what_it_says(environment: Path, tmp_path: Path) -> None:
    """In the repository of the tutorial's ego, whose campaign has failures; the first one is pinned."""
    (job,) = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"].values()
    install, check, campaign, pinned = [step["run"] for step in job["steps"] if "run" in step]
    tutorial = (REPOSITORY / "docs" / "tutorials" / "your-own-ego.md").read_text(encoding="utf-8")
    ego, document = re.findall(r"^```toml\n(.*?)^```", tutorial, re.DOTALL | re.MULTILINE)
    (tmp_path / "mine.toml").write_text(ego, encoding="utf-8")
    bounded = document.replace("episodes = 20", "episodes = 16") + "\n[acceptance]\nfailure_rate = 0.99\n"
    (tmp_path / "campaign.toml").write_text(bounded, encoding="utf-8")
    shutil.copyfile(REPOSITORY / "requirements.lock", tmp_path / "requirements.lock")
    (wheel,) = environment.parent.glob("*.whl")
    (tmp_path / "wheels").mkdir()
    shutil.copyfile(wheel, tmp_path / "wheels" / wheel.name)
    path = f"{environment / 'bin'}:{Path(sys.prefix) / 'bin'}:{os.environ['PATH']}"
    # whichever pip the path has, it installs into the environment of the wheel, and from nowhere else
    pip = {"PIP_PYTHON": str(environment / "bin" / "python"), "PIP_NO_INDEX": "1"}

    def step(command: str, ego: str = "mine.toml", expected: int = 0) -> str:
        bash = ("/bin/bash", "-e", "-c", command)
        variables = {"PATH": path, "EGO": ego, "NUMBA_DISABLE_JIT": "1"}  # compiling takes longer than these games
        return run(environment, tmp_path, *bash, expected=expected, **variables, **pip).stdout

    assert wheel.name in step(install)
    assert "assess naive_vs_paper_speedy-seed11" in step(check)
    assert "PASS  failures, paper_speedy" in step(campaign)
    assert (tmp_path / "reports" / "my_ego" / "report.html").is_file()
    games = pd.read_csv(tmp_path / "reports" / "my_ego" / "episodes.csv")
    arm, episode = games.loc[games["ego_failed"].eq(1), ["arm", "episode"]].iloc[0]
    step(f'harness minimise reports/my_ego {arm} {episode} --ego "$EGO" --out pinned')
    assert "0 of 1 pinned games pass" in step(pinned, expected=NOT_ACCEPTED)
    assert "1 of 1 pinned games pass" in step(pinned, ego=f"{FOLDER}/{RETRAINED}")
    assert 'tests="1" failures="0"' in (tmp_path / "reports" / "pinned.xml").read_text(encoding="utf-8")


# --- metadata ---------------------------------------------------------------------------------------------------------


def declared() -> tuple[list[str], dict[str, list[str]]]:
    """The requirements of the package: of every user, and by extra."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == DISTRIBUTION
    return project["dependencies"], project["optional-dependencies"]


def names_of(requirements: Iterable[str]) -> set[str]:
    return {re.split(r"[^A-Za-z0-9._-]", each, maxsplit=1)[0].lower().replace("_", "-") for each in requirements}


def lines_of(path: Path) -> list[str]:
    """The requirements in a file of pip's, without comments and options."""
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and line[0] not in "#-"]


def imported(path: Path) -> set[str]:
    """The packages that a file imports from outside the standard library."""
    names = []
    for node in ast.walk(tree_of(path)):
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [str(node.module)] if isinstance(node, ast.ImportFrom) and not node.level else []
    return {name.split(".")[0] for name in names} - set(sys.stdlib_module_names) - {"harness", "tomllib"}


def test_metadata__names_every_library_that_the_package_imports() -> None:
    provided = importlib.metadata.packages_distributions()
    always, extras = declared()
    users = names_of(itertools.chain(always, *(extras[name] for name in extras if name not in ("dev", "docs"))))
    needed = {name for path in SOURCES for name in imported(path)}
    assert {name for name in needed if not names_of(provided.get(name, [name])) & users} == set()


def test_metadata__examples_depend_on_this_distribution_and_on_locked_ones() -> None:
    """An example that names another distribution would install a stranger's package."""
    known = {DISTRIBUTION} | names_of(lines_of(REPOSITORY / "requirements.lock"))
    for file in (REPOSITORY / "egos").rglob("requirements*.txt"):
        assert names_of(lines_of(file)) <= known, file
    projects = list((REPOSITORY / "egos").rglob("pyproject.toml"))
    assert REPOSITORY / "egos/examples/python/pyproject.toml" in projects
    for file in projects:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
        extras = itertools.chain(*document["project"].get("optional-dependencies", {}).values())
        needed = [*document["build-system"]["requires"], *document["project"].get("dependencies", []), *extras]
        assert names_of(needed) <= known, file


def test_metadata__hints_name_the_distribution_and_its_extras() -> None:
    """A hint about a library that is not installed says `pip install 'safedriverl-harness[EXTRA]'`."""
    extras = declared()[1]
    texts = [*SOURCES, REPOSITORY / "README.md", *(REPOSITORY / "docs").rglob("*.md")]
    hints = {match for text in texts for match in re.findall(r"([\w-]*harness)\[(\w+)\]", text.read_text("utf-8"))}
    assert {name for name, _ in hints} == {DISTRIBUTION}
    assert {extra for _, extra in hints} <= set(extras)
    assert {"fmi", "ray", "docs"} <= {extra for _, extra in hints}
    strangers = re.compile(r"pip install [^\n#`]*(?<![\w./-])harness(?![\w.-])")
    assert [text for text in texts if strangers.search(text.read_text("utf-8"))] == []
