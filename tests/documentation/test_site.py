"""The documentation site: built strictly, with every page in the navigation, and the notebooks of two tutorials run."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import harness
from tests.support.repository import REPOSITORY

pytest.importorskip("sphinx", reason="Sphinx's versions here need Python 3.11")
SITE = REPOSITORY / "docs" / "site"
pytestmark = pytest.mark.slow


def script(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, SITE / name, *map(str, arguments)], capture_output=True, text=True, timeout=600
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    done = script("build.py", out)
    assert (done.returncode, done.stderr) == (0, "")
    return out


def text_of(page: Path) -> str:
    return re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8"))


def test_reference__has_every_public_name_command_and_key(site: Path) -> None:
    python, commands = text_of(site / "reference" / "api.html"), text_of(site / "reference" / "cli.html")
    assert [name for name in harness.__all__ if f"harness.{name}" not in python] == []
    assert all(name in commands for name in ("harness campaign", "harness scene show", "--json"))
    campaign = text_of(site / "reference" / "campaign.html")
    assert all(key in campaign for key in ("personas", "early_convergence", "failure_rate_alone"))


def test_first_page__begins_with_a_film_and_leads_to_a_report_that_is_on_the_site(site: Path) -> None:
    page = (site / "index.html").read_text(encoding="utf-8")
    assert page.index("merge-naive.gif") < page.index("<h2>")
    (report,) = re.findall(r'<a href="(reports/[^"]+)"', page)
    assert 'id="player"' in (site / report).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def notebooks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("notebooks")
    done = script("notebooks.py", folder)
    assert done.returncode == 0, done.stderr
    shutil.copytree(REPOSITORY / "reports" / "paper_merge", folder / "reports" / "paper_merge")
    return folder


@pytest.mark.parametrize("name", ["first-campaign", "reading-a-report"])
def test_notebook__runs(name: str, notebooks: Path) -> None:
    notebook = nbformat.read(notebooks / f"{name}.ipynb", as_version=4)
    client = NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(notebooks)}}
    )
    client.execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) >= 3
    assert code[-1].outputs
