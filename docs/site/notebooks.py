"""Tutorials as notebooks: `python docs/site/notebooks.py OUT` writes those with Python into a folder.

Text becomes cells of Markdown, each block of Python a cell of code; a test runs them.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import nbformat

TUTORIALS = Path(__file__).resolve().parents[1] / "tutorials"
NAMES = ("first-campaign", "reading-a-report")
_PYTHON = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)


def notebook_of(text: str) -> Any:
    """A page of Markdown as a notebook."""
    cells = []
    for place, part in enumerate(_PYTHON.split(text)):
        make = nbformat.v4.new_code_cell if place % 2 else nbformat.v4.new_markdown_cell
        if part.strip():
            cells.append(make(part.strip(), id=f"cell-{place}"))
    return nbformat.v4.new_notebook(cells=cells)


def write_notebooks(folder: Path) -> list[Path]:
    """Write the notebooks; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}.ipynb" for name in NAMES]
    for file in files:
        nbformat.write(notebook_of((TUTORIALS / f"{file.stem}.md").read_text(encoding="utf-8")), file)
    return files


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/site/notebooks.py OUT")
    for written in write_notebooks(Path(sys.argv[1])):
        print(written)
