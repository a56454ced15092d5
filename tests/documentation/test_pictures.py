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
TAKEN = {DOCS / each.file: each for several in (pictures.PUBLISHED | pictures.TUTORIALS).values() for each in several}
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


def test_steps__write_files_and_run_commands_in_the_order_of_the_page(tmp_path: Path) -> None:
    done = subprocess.run(["bash", "-ec", "".join(steps.steps_of(PAGE))], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "mine.toml\n")
    assert (tmp_path / "copy.toml").read_text() == 'name = "mine"\ncosts = "$5"\n'


@pytest.mark.slow
def test_tutorial__of_a_junction_works_as_it_is_written(tmp_path: Path) -> None:
    steps.carry_out("your-own-junction", tmp_path)
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


def test_pictures__of_tutorials_are_all_shown() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in steps.TUTORIALS.glob("*.md"))
    files = {file for file in TAKEN if file.parent == steps.TUTORIALS}
    assert files == set(steps.TUTORIALS.glob("*.png"))
    assert [file.name for file in sorted(files) if f"]({file.name})" not in text] == []
