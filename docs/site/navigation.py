"""The order of the site's pages: the first page, with the tree that Sphinx shows beside every page."""

from __future__ import annotations

from harness.config.json_schema import DOCUMENTS

SECTIONS = {
    "Tutorials": (
        "tutorials/first-campaign",
        "tutorials/your-own-ego",
        "tutorials/your-own-person",
        "tutorials/your-own-junction",
        "tutorials/reading-a-report",
        "tutorials/from-a-failure-to-a-regression-test",
    ),
    "How-to guides": (
        "installation",
        "campaigns",
        "commands",
        "league",
        "roads",
        "egos",
        "observation",
        "egos-by-rules",
        "egos-by-networks",
        "egos-by-programs",
        "egos-in-cartesian",
        "egos-by-ros2",
        "egos-by-fmus",
        "reconfiguration",
        "shield",
        "personas",
        "scenes",
        "several-people",
        "followers",
        "junctions",
        "people-on-foot",
        "route-files",
        "maps",
        "map-files",
        "environments",
        "report",
        "many-runs",
        "acceptance",
        "regression",
        "export",
        "scaling",
    ),
    "Concepts": (
        "glossary",
        "verdicts",
        "competence",
        "attribution",
        "preventability",
        "perception",
        "falsification",
        "manoeuvres",
        "manoeuvre-numbers",
        "game",
        "rounds",
        "architecture",
        "testing",
        "reliability",
        "security",
    ),
    "Results": (
        "results",
        "game-on-the-merge",
        "robust",
        "one-ego-for-all-scenes",
        "baselines",
        "reproduction",
        "reproduction-assumptions",
        "realism",
        "learning-curves",
        "performance",
        "step-cost",
    ),
    "Reference": (
        "reference/cli",
        "reference/api",
        *(f"reference/{kind}" for kind in DOCUMENTS),
        "columns",
        "publications",
    ),
    "Project": ("changelog", "contributing", "site"),
}


def index() -> str:
    """The first page: the README, and all pages by section."""
    lines = ["```{include} readme.md", "```", ""]
    for section, pages in SECTIONS.items():
        lines += ["```{toctree}", ":hidden:", f":caption: {section}", "", *pages, "```", ""]
    return "\n".join(lines)
