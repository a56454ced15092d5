"""Templates of the pages. Style sheets are included by the templates; scripts are inserted unchanged."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from harness.errors import UsageError
from harness.files import check_new_file, write_atomically
from harness.reports.numbers import duration, number, p_number, percent, short

CONTENT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
"""What the page may load: nothing but itself."""
SERVED_POLICY = f"{CONTENT_POLICY}; connect-src 'self'"
"""That of the page that `harness serve` sends: it may fetch from there as well."""
ELSEWHERE = '<script type="application/json" id="elsewhere">{}</script>'
"""The list of the games that the page may fetch: empty in the file; `harness serve` fills it."""
SCRIPTS = tuple(
    f"{name}.js"
    for name in (
        *("recorded", "road", "sight", "vehicles", "labels", "strips", "screen", "player"),
        *("tables", "games_list", "controls", "clips", "figures", "folds"),
    )
)
"""In the order in which they use one another."""
LIBRARIES = ("vendor/uPlot.iife.min.js", "vendor/dataTables.min.js")
"""Libraries that the page contains as they are published; their licences are beside them."""


@cache
def environment_of(folder: str, autoescape: bool = True) -> Environment:
    """The template environment of a folder of the package `harness`.

    Templates write numbers with the functions of `harness.reports.numbers`, which are filters. `autoescape` is for
    HTML and XML.
    """
    environment = Environment(
        loader=PackageLoader("harness", folder),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {each.__name__: each for each in (number, short, percent, p_number, duration)}
    return environment


def page_of(template: str, **values: Any) -> str:
    """A page of the room `reports` as HTML, from its template and what that shows. Equal values give equal text."""
    return environment_of("reports").get_template(f"{template}.html.jinja").render(values).strip() + "\n"


def sources(names: Sequence[str]) -> Markup:
    """Scripts as one text, unchanged: a script is no template."""
    environment = environment_of("reports")
    assert environment.loader is not None
    texts = [environment.loader.get_source(environment, name)[0].rstrip() for name in names]
    return Markup("\n".join(texts))


def served_page(page: str, games: Sequence[Sequence[Any]], run: str) -> str:
    """The page as a server sends it: with a list of the games that it may fetch from there as `games/KEY.json`.

    `games` have arm, persona, seed, episode, outcome, least time to collision (s, None: none), the cause of a failure,
    severity and delta-v (m/s, None: none). Raises UsageError for another page; `run` is the folder that the message
    names.
    """
    empty = ELSEWHERE.format("[]")
    if CONTENT_POLICY not in page or empty not in page:
        raise UsageError.of("report.html", run, "is not a report of this harness", f"harness report {run}")
    page = page.replace(CONTENT_POLICY, SERVED_POLICY, 1)
    return page.replace(empty, ELSEWHERE.format(json_text(games)), 1)


def json_text(value: Any) -> str:
    """JSON that cannot end a script element and contains no markup."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def write_page(file: Path, page: str) -> None:
    """Write a page that a command was asked for. Raises UsageError when the file's name or folder is wrong."""
    if file.suffix.lower() not in (".html", ".htm"):
        raise UsageError.of("--html", str(file), "is not the name of a page", "it must end with .html")
    check_new_file(file, "--html")
    write_atomically(file, page.encode())
