"""A persona's profile as one HTML file: opens offline, loads nothing."""

from __future__ import annotations

from pathlib import Path

from harness.errors import UsageError
from harness.files import write_atomically
from harness.reports.page_template import environment_of
from harness.reports.persona.figures import drives_figure, function_figure
from harness.reports.persona.profile import (
    ATTENDS,
    DECIDES,
    FORMULA,
    WANTS,
    PersonaProfile,
    attends,
    body,
    decides,
    function_in_words,
    lapses_of,
    number,
    sees,
    wants,
)


def write_profile(profile: PersonaProfile, file: Path) -> None:
    """Write the page. Raises UsageError when the file's name or folder is wrong."""
    if file.suffix.lower() not in (".html", ".htm"):
        raise UsageError.of("--html", str(file), "is not the name of a page", "it must end with .html")
    if not file.absolute().parent.is_dir():
        raise UsageError.of("--html", str(file), f"there is no folder {file.parent}", "create it, or name another file")
    write_atomically(file, render_profile(profile).encode())


def render_profile(profile: PersonaProfile) -> str:
    """The page as text. Equal portraits give equal pages."""
    functions = []
    for k, each in enumerate(profile.functions, 1):
        words = function_in_words(each)
        functions.append((each, words, function_figure(each, f"function{k}", f"{each.name}: {words}")))
    lapses = None
    if profile.persona.human_factors.attention is not None:
        lapses = drives_figure(profile.drives, "drives", lapses_of(profile))
    page = (
        environment_of("reports/persona", "reports")
        .get_template("profile.html.jinja")
        .render(
            persona=profile.persona,
            headings={"wants": WANTS, "attends": ATTENDS, "decides": DECIDES},
            formula=FORMULA,
            terms=profile.terms,
            wants=list(wants(profile)),
            functions=functions,
            attends=[*attends(profile), *sees(profile), *body(profile)],
            drives_figure=lapses,
            decides=decides(profile),
            number=number,
        )
    )
    return page.strip() + "\n"
