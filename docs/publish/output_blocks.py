"""The parts of a Markdown document that are the output of a command.

<!-- output of: python docs/game/figures.py gaps reports/merge-seeds -->

| a table |

<!-- end of output -->
"""

from __future__ import annotations

import re
from collections.abc import Mapping

_BLOCK = re.compile(r"(<!-- output of: (?P<command>[^\n]+?) -->\n)(?P<output>.*?)(<!-- end of output -->)", re.DOTALL)


def blocks_in(text: str) -> dict[str, str]:
    """The output of each command in a document, by the command."""
    return {match["command"]: match["output"].strip() for match in _BLOCK.finditer(text)}


def with_outputs(text: str, outputs: Mapping[str, str]) -> str:
    """The document with these outputs of these commands; other blocks stay as they are."""

    def block(match: re.Match[str]) -> str:
        output = outputs.get(match["command"])
        return match[0] if output is None else f"{match[1]}\n{output.strip()}\n\n{match[4]}"

    return _BLOCK.sub(block, text)
