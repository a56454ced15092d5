"""The steps of a tutorial as a script of bash: its files are written and its commands run, in the order of the page.

    ```sh
    harness check campaign.toml
    ```

is a command. A block of TOML or XML is a file if the paragraph above it begins with its name. Python is left out.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

TUTORIALS = Path(__file__).parents[1] / "tutorials"
_STEP = re.compile(
    r"^(?:`(?P<file>[^`\n]+\.(?:toml|xml))`(?:[^\n]+\n)+\n)?```(?P<language>sh|toml|xml)\n(?P<text>.*?)^```",
    re.DOTALL | re.MULTILINE,
)
_START = 'set -e\nharness() { command harness "$@" || test $? -eq 3; }  # a bound that is not kept is a result, too\n'


def carry_out(tutorial: str, folder: Path) -> None:
    """Carry out the steps of a tutorial in a folder. Raises CalledProcessError if a command fails."""
    steps = steps_of((TUTORIALS / f"{tutorial}.md").read_text(encoding="utf-8"))
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(["bash", "-c", _START + "".join(steps)], cwd=folder, env=os.environ | {"PATH": programs}, check=True)


def steps_of(page: str) -> Iterator[str]:
    """The lines of bash of each step of a tutorial."""
    for step in _STEP.finditer(page):
        if step["language"] == "sh":
            yield step["text"]
        elif step["file"]:
            name = shlex.quote(step["file"])
            yield f"mkdir -p \"$(dirname {name})\"\ncat > {name} <<'END OF FILE'\n{step['text']}END OF FILE\n"
