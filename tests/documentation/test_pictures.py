"""The pictures of the tutorials, and the steps that lead to them."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from PIL import Image

from tests.support.repository import REPOSITORY
from tests.support.scripts import script

DOCS = REPOSITORY / "docs"
pictures, steps = script("publish/pictures.py"), script("publish/tutorial_steps.py")
SOURCES = (pictures.PUBLISHED, pictures.TUTORIALS, pictures.DESKTOPS)
TAKEN = {DOCS / each.file: each for source in SOURCES for several in source.values() for each in several}
NOTHING_TO_SEE = {("your-own-ego", "Next"), ("your-own-junction", "Two ways that cross")}
"""Sections that lead on, or only write a file that the next one shows."""
PICTURE, OUTPUT = r"^!\[[^\]]+\]\([^)]+\)$", r"^<!-- output of: [^\n]+ -->\n\n```\n.+?^```\n\n<!-- end of output -->$"
PAGE = """# A tutorial

`documents/mine.toml`, in an empty folder. It has
two lines:

```toml
name = "mine"
costs = "$5"
```

```sh
cat documents/mine.toml > copy.toml   # a command
cd documents
```

```toml
name = "of a shipped document"
```

```python
print("is left out")
```

```sh
ls
```
"""


BLOCKS = """# A tutorial

```sh
printf 'one\\ntwo  \\n'; pwd
```

<!-- output of: printf 'one\\ntwo  \\n'; pwd | tail -2 -->

What it was.

<!-- end of output -->

```sh
echo again; mkdir -p deeper
```

<!-- output of: echo again; mkdir -p deeper -->
<!-- end of output -->
"""


def test_outputs__are_what_the_commands_print(tmp_path: Path) -> None:
    assert steps.outputs_of(BLOCKS, tmp_path) == {
        "printf 'one\\ntwo  \\n'; pwd | tail -2": f"```\ntwo\n{tmp_path}\n```",
        "echo again; mkdir -p deeper": "```\nagain\n```",
    }


def test_outputs__of_a_command_that_fails_are_not_shown(tmp_path: Path) -> None:
    page = "```sh\nfalse\n```\n\n<!-- output of: false -->\n<!-- end of output -->\n"
    with pytest.raises(subprocess.CalledProcessError):
        steps.outputs_of(page, tmp_path)


def test_steps__write_files_and_run_commands_in_the_order_of_the_page(tmp_path: Path) -> None:
    done = subprocess.run(["bash", "-ec", "".join(steps.steps_of(PAGE))], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "mine.toml\n")
    assert (tmp_path / "copy.toml").read_text() == 'name = "mine"\ncosts = "$5"\n'


@pytest.mark.slow
def test_tutorial__of_a_junction_works_as_it_is_written(tmp_path: Path) -> None:
    steps.outputs_of((steps.TUTORIALS / "your-own-junction.md").read_text(encoding="utf-8"), tmp_path)
    assert [page.name for page in sorted(tmp_path.glob("*.html"))] == ["crossing.html", "net.html"]


@pytest.mark.parametrize("page", sorted(steps.TUTORIALS.glob("*.md")), ids=lambda page: page.stem)
def test_tutorial__shows_pictures_that_are_taken_by_a_command(page: Path) -> None:
    shown = re.findall(r"^!\[([^\]]+)\]\(([^)]+)\)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert shown
    for words, name in shown:
        file = (page.parent / name).resolve()
        assert len(words.split()) >= 10, f"{name}: say what is seen"
        assert file.stat().st_size <= 120e3 or file.parent != steps.TUTORIALS
        with Image.open(file) as picture:
            assert picture.size == (TAKEN[file].width, TAKEN[file].height)


@pytest.mark.parametrize("page", sorted(steps.TUTORIALS.glob("*.md")), ids=lambda page: page.stem)
def test_tutorial__each_section_shows_what_its_step_leads_to(page: Path) -> None:
    sections = re.split(r"^## (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    shows = re.compile(
        f"{PICTURE}|{OUTPUT}|^```python$", re.DOTALL | re.MULTILINE
    )  # the site runs the blocks of Python
    bare = {
        (page.stem, title) for title, text in zip(sections[::2], sections[1::2], strict=True) if not shows.search(text)
    }
    assert bare == {each for each in NOTHING_TO_SEE if each[0] == page.stem}


@pytest.mark.parametrize("page", sorted(steps.TUTORIALS.glob("*.md")), ids=lambda page: page.stem)
def test_tutorial__prints_only_what_its_commands_print(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    fences = re.findall(r"^```.*$", re.sub(OUTPUT, "", text, flags=re.DOTALL | re.MULTILINE), re.MULTILINE)
    assert "```" not in fences[::2]
    for block in re.finditer(r"^<!-- output of: ([^\n]+?)(?: \| [^\n]+)? -->$", text, re.MULTILINE):
        before = "".join(re.findall(r"^```sh\n(.*?)^```", text[: block.start()], re.DOTALL | re.MULTILINE))
        assert block[1] in before.splitlines(), block[1]


def test_pictures__of_tutorials_are_all_shown() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in steps.TUTORIALS.glob("*.md"))
    files = {file for file in TAKEN if file.parent == steps.TUTORIALS}
    assert files == set(steps.TUTORIALS.glob("*.png"))
    assert [file.name for file in sorted(files) if f"]({file.name})" not in text] == []
