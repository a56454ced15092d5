"""The steps of a tutorial as a script of bash: its files are written and its commands run, in the order of the page.

    ```sh
    harness check campaign.toml
    ```

is a command. A block of TOML or XML is a file if the paragraph above it begins with its name. Python is left out.

    <!-- output of: harness check campaign.toml | head -3 -->

begins a block of what that command printed when it was last run before, through filters if there are any.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from output_blocks import blocks_in, with_outputs

TUTORIALS = Path(__file__).parents[1] / "tutorials"
COLUMNS = 100
_STEP = re.compile(
    r"^(?:`(?P<file>[^`\n]+\.(?:toml|xml))`(?:[^\n]+\n)+\n)?```(?P<language>sh|toml|xml)\n(?P<text>.*?)^```"
    r"|^<!-- output of: (?P<output>[^\n]+?) -->$",
    re.DOTALL | re.MULTILINE,
)
_START = 'set -eo pipefail\nharness() { command harness "$@" || test $? -eq 3; }  # an unkept bound is a result, too\n'


def carry_out(tutorial: str, folder: Path) -> None:
    """Carry out the steps of a tutorial in a folder, and write what they print into its page.

    Raises CalledProcessError if a command fails.
    """
    file = TUTORIALS / f"{tutorial}.md"
    page = file.read_text(encoding="utf-8")
    outputs = outputs_of(page, folder)
    file.write_text(with_outputs(page, outputs), encoding="utf-8")


def outputs_of(page: str, folder: Path) -> dict[str, str]:
    """What the commands of a page print, in a fence, by what its blocks begin with. Raises CalledProcessError."""
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as printed:
        more = {"PATH": programs, "PRINTED": printed, "COLUMNS": str(COLUMNS)}
        script = _START + "".join(steps_of(page))
        subprocess.run(["bash", "-c", script], cwd=folder, env=os.environ | more, check=True)
        texts = [(Path(printed) / str(place)).read_text(encoding="utf-8") for place in range(len(blocks_in(page)))]
    lines = (text.replace(f"{folder}/", "").splitlines() for text in texts)
    shown = ("\n".join(line.rstrip() for line in each).strip("\n") for each in lines)
    return dict(zip(blocks_in(page), (f"```\n{text}\n```" for text in shown), strict=True))


def steps_of(page: str) -> Iterator[str]:
    """The lines of bash of each step of a tutorial."""
    blocks = 0
    for step in _STEP.finditer(page):
        if step["output"]:
            command, _, filters = step["output"].partition(" | ")
            yield f'< "$PRINTED"/{_name(command)} {filters or "cat"} > "$PRINTED"/{blocks}\n'
            blocks += 1
        elif step["language"] == "sh":
            yield _noted(step["text"], {each.partition(" | ")[0] for each in blocks_in(page)})
        elif step["file"]:
            name = shlex.quote(step["file"])
            yield f"mkdir -p \"$(dirname {name})\"\ncat > {name} <<'END OF FILE'\n{step['text']}END OF FILE\n"


def _noted(commands: str, shown: set[str]) -> str:
    """Commands, one a line, that also keep what they print if it is shown."""
    lines = commands.splitlines(keepends=True)
    return "".join(
        f'{{ {line.strip()}; }} 2>&1 | tee "$PRINTED"/{_name(line.strip())}\n' if line.strip() in shown else line
        for line in lines
    )


def _name(command: str) -> str:
    return "of-" + command.encode().hex()[:200]
