"""The page of a run as a server sends it: it may fetch the recorded games that its file has no room for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from harness.errors import UsageError
from harness.reports.embedding import json_text
from harness.reports.page_template import CONTENT_POLICY, ELSEWHERE

NOT_SERVED = "is not a page that this version wrote"
WRITE_ANEW = "harness report {run}"

Entry = Sequence[Any]
"""Arm, persona, seed, episode, outcome and least time to collision (s, None: none) of a game."""


def served_page(page: str, games: Sequence[Entry], run: str) -> str:
    """The page with a list of games that it may fetch from its own server as `games/KEY.json`.

    Raises UsageError for a page that another version wrote; `run` is the folder that the message names.
    """
    empty = ELSEWHERE.format("[]")
    if CONTENT_POLICY not in page or empty not in page:
        raise UsageError.of("report.html", run, NOT_SERVED, WRITE_ANEW.format(run=run))
    page = page.replace(CONTENT_POLICY, f"{CONTENT_POLICY}; connect-src 'self'", 1)
    return page.replace(empty, ELSEWHERE.format(json_text(games)), 1)
