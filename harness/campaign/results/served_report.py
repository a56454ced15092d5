"""The report of a run over HTTP: the page, and each recorded game when it is opened."""

from __future__ import annotations

import math
import re
from functools import cached_property
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any
from urllib.parse import unquote

import pandas as pd

from harness.campaign.results.recorded_games import tracks_of
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.people import judged
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import worst_first
from harness.reports.embedding import game_text
from harness.reports.manoeuvres import marks_of
from harness.reports.page_template import served_page
from harness.reports.run_tables import crowds_of
from harness.road.scene.open_scene import open_scene

HOST = "127.0.0.1"
"""Only programs of this machine reach the server."""
_GAME = re.compile(r"/games/(?P<arm>[^/]*),(?P<seed>\d+),(?P<episode>\d+)\.json")
PAGE, JSON = "text/html; charset=utf-8", "application/json"


class ServedReport:
    """What the server of a run's report sends, by path."""

    def __init__(self, folder: RunFolder) -> None:
        """Raises UsageError if the folder has no report, table of games or scene."""
        self._folder, self._reader, self._lock = folder, TraceReader(), Lock()
        for needed in ("report.html", "episodes.csv", "traces"):
            if not (folder.path / needed).exists():
                raise UsageError.of(folder.path, needed, "is not there", f"harness report {folder.path}")
        self._scene = open_scene(folder.scene)
        episodes = read_csv(folder.path / "episodes.csv")
        played = worst_first(episodes[(episodes["error"] == "") & (episodes["ego_outcome"] != "error")])
        rows: list[Any] = list(played.itertuples())
        self._games = {(game.arm, game.seed, game.episode): game for game in rows}
        page = (folder.path / "report.html").read_text(encoding="utf-8")
        self._page = served_page(page, [_entry(game) for game in self._games.values()], str(folder.path))

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Content type and content of a path; None if there is nothing."""
        if path in ("/", "/report.html"):
            return PAGE, self._page.encode()
        named = _GAME.fullmatch(path)
        game = self._games.get((unquote(named["arm"]), int(named["seed"]), int(named["episode"]))) if named else None
        return None if game is None else (JSON, self._recorded(game))

    @cached_property
    def _marks(self) -> Any:
        file = self._folder.path / "manoeuvres.csv"
        return marks_of(read_csv(file) if file.is_file() else None)

    def _recorded(self, game: Any) -> bytes:
        with self._lock:  # the reader keeps one file open
            trace = self._reader.read(self._folder.traces_of_arm(game.arm, game.seed), game.episode)
        crowds = crowds_of(self._folder.manifest())
        return game_text(tracks_of(trace, self._scene, game), self._marks, crowds).encode()


def _entry(game: Any) -> list[Any]:
    least = getattr(game, "ego_min_ttc_s", math.nan)
    outcome = judged(game._asdict())[1]
    return [game.arm, game.persona, game.seed, game.episode, outcome, None if pd.isna(least) else round(least, 2)]


def server_of(report: ServedReport, port: int) -> ThreadingHTTPServer:
    """A server of this machine that answers with a report; port 0 takes a free one. Raises OSError for one in use."""

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            known = self.headers.get("Host") in (f"{HOST}:{server.server_port}", f"localhost:{server.server_port}")
            found = report.answer(self.path) if known else None  # another name of this machine may be another site
            if found is None:
                self.send_error(404)
                return
            kind, content = found
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: Any) -> None:
            """Requests are not printed."""

    server = ThreadingHTTPServer((HOST, port), Answers)
    return server
