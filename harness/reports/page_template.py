"""Templates of the pages. Style sheets are included by the templates; scripts are inserted unchanged."""

from __future__ import annotations

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

SCRIPTS = tuple(
    f"{name}.js"
    for name in ("recorded", "road", "sight", "vehicles", "strips", "screen", "player", "controls", "clips", "tables")
)
"""In the order in which they use one another."""


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


def _source(environment: Environment, name: str) -> str:
    assert environment.loader is not None
    return environment.loader.get_source(environment, name)[0].rstrip()
