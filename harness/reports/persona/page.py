"""A persona's portrait as one HTML file: opens offline, loads nothing."""

from __future__ import annotations

from pathlib import Path

from harness.errors import UsageError
from harness.files import write_atomically
from harness.reports.page_template import environment_of
from harness.reports.persona.drives import DRIVE_S
from harness.reports.persona.figures import drives_figure, function_figure
from harness.reports.persona.profile import (
    FORMULA,
    PersonaProfile,
    attends,
    body,
    decides,
    function_in_words,
    number,
    sees,
    wants,
)


def write_profile(portrait: PersonaProfile, file: Path) -> None:
    """Write the page. Raises UsageError when it can't be written there."""
    if file.suffix.lower() not in (".html", ".htm"):
        raise UsageError.of("--html", str(file), "is not the name of a page", "it has to end with .html")
    if not file.absolute().parent.is_dir():
        raise UsageError.of("--html", str(file), f"there is no folder {file.parent}", "make it, or name another file")
    write_atomically(file, render_profile(portrait).encode())


def render_profile(portrait: PersonaProfile) -> str:
    """The page as text. Equal portraits give equal pages."""
    functions = []
    for k, each in enumerate(portrait.functions, 1):
        words = function_in_words(each)
        functions.append((each, words, function_figure(each, f"function{k}", f"{each.name}: {words}")))
    lapses = None
    if portrait.persona.human_factors.attention is not None:
        words = f"When attention lapses in {len(portrait.drives)} drives of {DRIVE_S:g} s"
        lapses = drives_figure(portrait.drives, "drives", words)
    page = (
        environment_of("reports/persona", "reports")
        .get_template("profile.html.jinja")
        .render(
            persona=portrait.persona,
            formula=FORMULA,
            terms=portrait.terms,
            wants=list(wants(portrait)),
            functions=functions,
            attends=[*attends(portrait), *sees(portrait), *body(portrait)],
            drives_figure=lapses,
            decides=decides(portrait),
            number=number,
        )
    )
    return page.strip() + "\n"
