"""The pages of the documentation: the files, tests, pages, pictures and headings that they name exist; none is long."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.support.repository import REPOSITORY
from tests.support.scripts import script

PAGES = [REPOSITORY / folder / "README.md" for folder in ("", "reports", "policies")]
PAGES += [REPOSITORY / name for name in ("CONTRIBUTING.md", "CHANGELOG.md")]
PAGES += sorted([*(REPOSITORY / "docs").rglob("*.md"), *(REPOSITORY / ".github").rglob("*.md")])
NAMED_FILE = re.compile(r"\b(?:tests|harness|benchmarks)/[\w/.-]*\w+\.(?:py|toml|json|jinja)\b")
NAMED_TEST = re.compile(r"\b(tests/[\w/]+\.py)::(test_\w+)")
NEW_FILE = re.compile(r"^`([^`]+)`, a new file:$", re.MULTILINE)  # of a recipe
CODE = re.compile(r"^ *```.*?^ *```|`[^`\n]+`", re.DOTALL | re.MULTILINE)
NOT_READ_THROUGH = re.compile(r"^ *```.*?^ *```|<!-- output of: .*?<!-- end of output -->", re.DOTALL | re.MULTILINE)
MOST_WORDS = 1500
LONGER = {
    "columns.md": "a table for looking up, which `harness columns` writes",
}
LINK = re.compile(r"\]\((?![a-z]+:)([^)\s#]*)#?([^)\s]*)\)")
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(REPOSITORY).as_posix())


def functions_in(path: Path) -> set[str]:
    """The names of the test functions of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def anchors_of(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and the site make them."""
    headings = re.findall(r"^#+ (.*)", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


def leads_nowhere(page: Path, target: str, anchor: str) -> bool:
    """Whether a link of a page names no file, or a heading that its page does not have."""
    there = page.parent / target if target else page
    return not there.exists() or bool(anchor and anchor not in anchors_of(there))


@each_page
def test_page__every_named_file_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = set(NAMED_FILE.findall(text)) - set(NEW_FILE.findall(text))
    assert [name for name in sorted(named) if not (REPOSITORY / name).is_file()] == []


@each_page
def test_page__every_named_test_exists(page: Path) -> None:
    named = set(NAMED_TEST.findall(page.read_text(encoding="utf-8")))
    files = {file: functions_in(REPOSITORY / file) for file, _ in named if (REPOSITORY / file).is_file()}
    assert [f"{file}::{test}" for file, test in sorted(named) if test not in files.get(file, ())] == []


@each_page
def test_page__every_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    links = LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))
    assert [link for link in links if leads_nowhere(page, *link)] == []


def words_of(text: str) -> int:
    """The number of words of a page without its blocks of code and its output of commands, as `wc -w` counts them."""
    return len(NOT_READ_THROUGH.sub("", text).split())


def test_page__has_at_most_1500_words() -> None:
    docs = REPOSITORY / "docs"
    words = {
        file.relative_to(docs).as_posix(): words_of(file.read_text(encoding="utf-8")) for file in docs.rglob("*.md")
    }
    assert {name: count for name, count in words.items() if count > MOST_WORDS and name not in LONGER} == {}


def test_words__are_those_that_are_read_through() -> None:
    block = "<!-- output of: python table.py -->\n\n| a | b |\n\n<!-- end of output -->"
    assert words_of(f"# A page\n\n```sh\nharness demo\n```\n\n{block}\n\n| in | a table |\n") == 9


def test_site__its_navigation_has_every_page_of_docs() -> None:
    pages = {page for section in script("site/navigation.py").SECTIONS.values() for page in section}
    made = {page for page in pages if page.startswith("reference/")} | {"changelog", "contributing"}
    docs = REPOSITORY / "docs"
    assert pages - made == {page.relative_to(docs).with_suffix("").as_posix() for page in docs.rglob("*.md")}


def test_link__to_nothing_is_seen() -> None:
    page = REPOSITORY / "docs" / "verdicts.md"
    assert not leads_nowhere(page, "", "planned-tests")
    assert not leads_nowhere(page, "game.md", "the-best-response-gap")
    assert leads_nowhere(page, "game.md", "no-such-heading")
    assert leads_nowhere(page, "no_such_page.md", "")
