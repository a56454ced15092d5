"""The report of a run over HTTP: the page, and each recorded game when it is opened."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Lock
from typing import Any
from urllib.parse import unquote

import pandas as pd

from harness.campaign.results.read_run import episodes_of
from harness.campaign.results.recorded_games import delta_v_of, takeovers_of, tracks_of
from harness.campaign.results.replay_game import traces_of
from harness.campaign.storage.run_folder import TAKEN_OVER, RunFolder
from harness.errors import UsageError
from harness.evaluation.people import judged
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.unplayed_games import were_played
from harness.evaluation.worst_first import worst_first
from harness.reports.embedding import Causes, game_text, key
from harness.reports.manoeuvres import causes_by_game, marks_of
from harness.reports.page_template import SERVED_POLICY, served_page
from harness.reports.run_tables import crowds_of
from harness.road.scene.open_scene import open_scene

HOST = "127.0.0.1"
"""Only programs of this machine reach the server."""
IDLE_S = 30.0
"""A connection on which nothing comes for so long is closed."""
_GAME = re.compile(r"/games/(?P<arm>[^/]*),(?P<seed>\d{1,20}),(?P<episode>\d{1,20})\.json", re.ASCII)
PAGE, JSON = "text/html; charset=utf-8", "application/json"


class ServedReport:
    """What the server of a run's report sends, by path."""

    def __init__(self, folder: RunFolder) -> None:
        """Raises UsageError if the folder has no report, table of games, traces or scene, or others than it wrote."""
        self._folder, self._reader, self._lock = folder, TraceReader(), Lock()
        manifest = folder.manifest()
        folder.check_unpublished(manifest)
        self._crowds = crowds_of(manifest)
        page = folder.result("report.html").read_text(encoding="utf-8")
        episodes = episodes_of(folder)
        self._marks = marks_of(read_csv(folder.result("manoeuvres.csv")))
        self._causes = causes_by_game(read_csv(folder.result("causes.csv")))
        judged = (folder.path / TAKEN_OVER).is_file()
        self._takeovers = takeovers_of(read_csv(folder.result(TAKEN_OVER))) if judged else {}
        self._scene = open_scene(folder.scene)
        played = worst_first(episodes[were_played(episodes)])
        rows: list[Any] = list(played.itertuples())
        self._games = {(game.arm, game.seed, game.episode): game for game in rows}
        self._page = served_page(page, [entry_of(game, self._causes) for game in rows], str(folder.path))

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Content type and content of a path; None if there is nothing. Raises UsageError for a game whose traces are
        missing, or are not those that the campaign wrote."""
        if path in ("/", "/report.html"):
            return PAGE, self._page.encode()
        named = _GAME.fullmatch(path)
        game = self._games.get((unquote(named["arm"]), int(named["seed"]), int(named["episode"]))) if named else None
        return None if game is None else (JSON, self._recorded(game))

    def _recorded(self, game: Any) -> bytes:
        with self._lock:  # the reader keeps one file open
            traces = traces_of(self._folder, game.arm, game.seed, game.episode)
            trace = self._reader.read(traces, game.episode)
        tracks = tracks_of(trace, self._scene, game, self._takeovers.get((game.arm, game.seed, game.episode)))
        return game_text(tracks, self._marks, self._causes, self._crowds).encode()


def entry_of(game: Any, causes: Causes) -> list[Any]:
    """A game of the list, by its row of `episodes`, as `served_page` takes it."""
    least, delta_v_mps = getattr(game, "ego_min_ttc_s", math.nan), delta_v_of(game)
    return [
        *(game.arm, game.persona, game.seed, game.episode, judged(game._asdict())[1]),
        None if pd.isna(least) else round(least, 2),
        causes.get(key(game.arm, game.seed, game.episode), ""),
        0.0 if pd.isna(game.severity) else round(float(game.severity), 2),
        None if delta_v_mps is None else round(delta_v_mps, 1),
    ]


def server_of(answer: Callable[[str], tuple[str, bytes] | None], port: int) -> ThreadingHTTPServer:
    """A server of this machine. `answer` is `ServedReport.answer`; port 0 takes a free one. Raises OSError for one in
    use."""

    class Answers(BaseHTTPRequestHandler):
        timeout = IDLE_S

        def do_GET(self) -> None:
            known = self.headers.get("Host") in (f"{HOST}:{server.server_port}", f"localhost:{server.server_port}")
            try:
                found = answer(self.path) if known else None  # another name of this machine may be another site
            except UsageError as error:
                self.send_error(500, explain=str(error))
                return
            if found is None:
                self.send_error(404)
                return
            kind, content = found
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def end_headers(self) -> None:
            self.send_header("Content-Security-Policy", SERVED_POLICY)
            self.send_header("X-Content-Type-Options", "nosniff")
            super().end_headers()

        def log_message(self, format: str, *args: Any) -> None:
            """Requests are not printed."""

    class Server(ThreadingHTTPServer):
        def handle_error(self, request: Any, client_address: Any) -> None:
            if not isinstance(sys.exc_info()[1], ConnectionError):  # a page that was closed is no error
                super().handle_error(request, client_address)

    server = Server((HOST, port), Answers)
    return server
