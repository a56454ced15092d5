"""The commands for documents: new projects and personas, checks of campaigns, scenes and drivers, and schemas."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import wording
from harness.cli.output import AsJson, output, print_json
from harness.cli.scenes import check_scene, folder_of_scene
from harness.cli.terminal import print_plain
from harness.shipped_documents import document_at

if TYPE_CHECKING:
    from rich.console import Console

NOT_CONFORMANT = 1

AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code",
        help="Permit drivers that run code from a file: a program, an FMU, or a file of Stable-Baselines3. Such code "
        "can do everything that you can: use this only for files that you trust.",
    ),
]
persona_app = typer.Typer(
    no_args_is_help=True, help="Create the document of a persona, and show what a persona's document means."
)


@persona_app.command("new")
def new_persona(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="The name of the persona, such as late_merger.", show_default=False)
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file.  [default: personas/NAME.toml]", show_default=False),
    ] = None,
) -> None:
    """Write a commented template of a persona: a valid document with every key. No file is overwritten."""
    from harness.cli.persona_template import create_persona

    file = create_persona(name, out)
    print(wording.persona_created(file))


@persona_app.command("check")
def check_persona(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="The TOML file of the persona, or the name of a shipped one.", show_default=False
        ),
    ],
) -> None:
    """Check a persona: its document, and that its sources are evidence and not the text of the template."""
    from harness.cli import persona_check

    file = document_at(file, "personas")
    print(wording.persona_in_order(file, persona_check.check_persona(file)))


@persona_app.command("show")
def show_persona(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="The TOML file of the persona, or the name of a shipped one.", show_default=False
        ),
    ],
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Also write an HTML page that opens offline.", show_default=False),
    ] = None,
) -> None:
    """Show the profile of a persona: the value of each term, membership functions, and a sample of its lapses."""
    from rich.console import Console

    from harness.config.persona import Persona
    from harness.config.toml_reading import read_document
    from harness.reports.persona.persona_terminal import show
    from harness.reports.persona.profile import persona_profile

    file = document_at(file, "personas")
    profile = persona_profile(read_document(file, Persona))
    if html is not None:
        from harness.reports.persona.persona_page import write_profile

        write_profile(profile, html)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # the terminal may not have every character
    console = Console()
    show(profile, console)
    if html is not None:
        console.print(wording.page_written(html), highlight=False, markup=False, soft_wrap=True)


def new(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The new folder.", show_default=False)],
) -> None:
    """Make a project: a campaign, a scene and a persona of your own, which run as they are, and a README."""
    from rich.console import Console

    from harness.cli.project import create_project

    print_plain(wording.project_created(folder, create_project(folder)), Console())


def check(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="PATH",
            help="The TOML file of a campaign or the name of a shipped one, or a scene.toml, or a scene's folder.",
            show_default=False,
        ),
    ],
    allow_code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Check a campaign and everything it names, and list its stages; or check one scene. Nothing is run or written."""
    with output(as_json) as console:
        if (folder := folder_of_scene(file)) is not None:
            lines = check_scene(folder)
            print_plain(lines, console)
            if as_json:
                print_json({"scene": str(folder), "in_order": True, "remarks": lines[1:]})
            return
        _check_campaign(document_at(file, "campaigns"), allow_code, as_json, console)


def _check_campaign(file: Path, allow_code: bool, as_json: bool, console: Console) -> None:
    from harness.campaign.execution.repeat_check import varying_drivers
    from harness.campaign.plan.plan import plan
    from harness.campaign.preflight import open_campaign
    from harness.config.campaign import LEARNED
    from harness.errors import plain

    opened = open_campaign(file, allow_code=allow_code)
    varying = varying_drivers(opened)
    stages = plan(opened.document, [persona.name for persona in opened.personas], opened.tunable)
    notes = opened.ego_driver.notes if opened.ego_driver is not None else ()
    ego = [] if opened.document.ego.driver == LEARNED else [wording.ego(opened), *notes]
    ego = [plain(each) for each in (*ego, *(f"{driver}: {told}" for driver, told in varying.items()))]
    remarks = [*opened.scene.warnings, *opened.persona_remarks, *ego]
    print_plain([wording.in_order(file), *remarks], console)
    print_plain([wording.work(opened, stages), *wording.stage_lines(stages)], console)
    if as_json:
        checked = {"campaign": opened.document.name, "file": str(file), "in_order": True}
        print_json({**checked, "remarks": remarks, "stages": wording.stage_records(stages)})


def schema(
    document: Annotated[
        str | None,
        typer.Argument(
            metavar="DOCUMENT",
            help="campaign, persona, scene or driver.  [default: all, with --out]",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write DOCUMENT.schema.json into this folder.", show_default=False),
    ] = None,
) -> None:
    """Print the JSON Schema of a kind of document, or write one or all schemas. Editors use them to complete and check
    TOML files."""
    from harness.cli.schema_files import write_schemas
    from harness.config.json_schema import DOCUMENTS, schema_text
    from harness.errors import UsageError

    if out is not None:
        for written in write_schemas(out, document):
            print(written)
    elif document is not None:
        print(schema_text(document), end="")
    else:
        raise UsageError.of("harness schema", "DOCUMENT", *wording.no_document_kind(tuple(DOCUMENTS)))


def columns(
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the page to this file.", show_default=False)
    ] = None,
) -> None:
    """Print what the columns of episodes.csv are, as Markdown: unit, formula and source of each."""
    from harness.files import write_atomically
    from harness.reports.columns_page import columns_page

    if out is None:
        print(columns_page(), end="")
    else:
        write_atomically(out, columns_page().encode())


def check_driver(
    driver: Annotated[
        str,
        typer.Argument(
            metavar="DRIVER",
            help="A driver document, a policy's folder, an installed driver, or sumo.",
            show_default=False,
        ),
    ],
    scene: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="The scene of the games, a folder or a name.  [default: merge]", show_default=False
        ),
    ] = Path("merge"),
    games: Annotated[int, typer.Option(min=2, max=1000, metavar="N", help="Games to play.")] = 3,
    allow_code: AllowCode = False,
) -> None:
    """Check that a driver conforms to the driver protocol, and list every violation.

    Plays seeded games twice, then replays their observations with all games at once. Exit code 1: it does not conform.
    """
    from rich.console import Console

    from harness.environments.conformance import check_named

    findings = check_named(driver, document_at(scene, "networks"), games, allow_code=allow_code)
    console = Console()
    for line in findings.lines():
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if findings.violations:
        raise typer.Exit(NOT_CONFORMANT)
