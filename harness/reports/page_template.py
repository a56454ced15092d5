"""Templates of the pages. Style sheets are included by the templates; scripts are inserted unchanged."""

from __future__ import annotations

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

CONTENT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
"""What the page may load: nothing but itself."""
ELSEWHERE = '<script type="application/json" id="elsewhere">{}</script>'
"""The list of the games that the page may fetch: empty in the file; `harness serve` fills it."""
SCRIPTS = tuple(
    f"{name}.js"
    for name in (
        *("recorded", "road", "sight", "vehicles", "strips", "screen", "player"),
        *("tables", "games_list", "controls", "clips", "figures", "folds"),
    )
)
"""In the order in which they use one another."""
LIBRARIES = ("vendor/uPlot.iife.min.js", "vendor/dataTables.min.js")
"""Libraries that the page contains as they are published; their licences are beside them."""


def environment_of(*folders: str) -> Environment:
    """The template environment of folders of the package `harness`; the first that has a template provides it."""
    return Environment(
        loader=ChoiceLoader([PackageLoader("harness", folder) for folder in folders]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def script(environment: Environment) -> Markup:
    """The page's scripts as one text. A script is no template."""
    return Markup("\n").join(Markup(_source(environment, name)) for name in SCRIPTS)


def libraries(environment: Environment) -> Markup:
    """The scripts of others that the page's own scripts use, as one text."""
    return Markup("\n").join(Markup(_source(environment, name)) for name in LIBRARIES)


def _source(environment: Environment, name: str) -> str:
    assert environment.loader is not None
    return environment.loader.get_source(environment, name)[0].rstrip()
