"""A server of reports that runs while a test reads from it."""

from __future__ import annotations

import threading
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import ThreadingHTTPServer

from harness.campaign.results.served_report import server_of


@contextmanager
def serving(answer: Callable[[str], tuple[str, bytes] | None]) -> Iterator[ThreadingHTTPServer]:
    """A server that runs during the block."""
    with server_of(answer, 0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def read(address: str, **headers: str) -> str:
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
        text: str = answer.read().decode()
        return text
