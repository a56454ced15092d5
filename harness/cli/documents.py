"""The commands for documents: new projects and personas, checks of campaigns, scenes and drivers, and schemas."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import messages
from harness.cli.output import AllowCode, AsJson, console_of_any_encoding, output, print_json, print_plain
from harness.cli.scenes import check_scene, folder_of_scene
from harness.errors import FAILED, UsageError, plain
from harness.shipped_documents import document_at
from harness.wording import counted

if TYPE_CHECKING:
    from rich.console import Console

PersonaFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="The TOML file of the persona, or the name of a shipped one.")
]
policy_app = typer.Typer(no_args_is_help=True, help="Export policies.")
persona_app = typer.Typer(
    no_args_is_help=True, help="Create the document of a persona, and show what a persona's document means."
)


@persona_app.command("new")
def new_persona(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The name of the persona, such as late_merger.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="The file.  [default: personas/NAME.toml]")] = None,
) -> None:
    """Write a commented template of a persona: a valid document with every key. No file is overwritten."""
    from harness.cli.new_documents import create_persona

    file = create_persona(name, out)
    show, check = f"harness persona show {file}", f"harness persona check {file}"
    print(f"{file}: a valid persona, a careful driver. To see what it means: {show}; what is left to write: {check}")


@persona_app.command("check")
def check_persona(file: PersonaFile) -> None:
    """Check a persona: its document, and that its sources are evidence and not the text of the template."""
    from harness.cli import new_documents

    file = document_at(file, "personas")
    persona = new_documents.check_persona(file)
    sources = counted(len(persona.sources), "source")
    print(f"{file} is in order: {persona.name}, {sources}. To see what it means: harness persona show {file}")


@persona_app.command("show")
def show_persona(
    file: PersonaFile,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write an HTML page that opens offline.")
    ] = None,
) -> None:
    """Show the profile of a persona: the value of each term, membership functions, and a sample of its lapses."""
    from harness.config.persona import Persona
    from harness.config.toml_reading import read_document
    from harness.reports.persona.persona_terminal import show
    from harness.reports.persona.profile import persona_profile

    file = document_at(file, "personas")
    profile = persona_profile(read_document(file, Persona))
    if html is not None:
        from harness.reports.page_template import write_page
        from harness.reports.persona.persona_page import render_profile

        write_page(html, render_profile(profile))
    console = console_of_any_encoding()
    show(profile, console)
    if html is not None:
        print_plain([f"Page: {html}"], console)


def new(folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The new folder.")]) -> None:
    """Make a project: a campaign, a scene and a persona of your own, which run as they are, and a README."""
    from harness.cli.new_documents import create_project

    written = [f"wrote {file}" for file in create_project(folder)]
    print_plain([*written, f"Next: cd {folder} && harness campaign campaign.toml --quick"], console_of_any_encoding())


def check(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="PATH",
            help="The TOML file of a campaign or the name of a shipped one, or a scene.toml, or a scene's folder.",
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
        _check_campaign(campaign_at(file), allow_code, as_json, console)


def campaign_at(file: Path) -> Path:
    """The file of a campaign, or of the shipped one of this name. Raises UsageError if it is a document of another
    kind."""
    from harness.config.scene import SCENE_FILE
    from harness.config.toml_reading import MOST_BYTES
    from harness.files import content_of

    file = document_at(file, "campaigns")
    if (folder := folder_of_scene(file)) is not None and (folder / SCENE_FILE).is_file():
        raise UsageError.of(file, "", "is a scene, not a campaign", f'name it in a campaign: scene = "{folder}"')
    try:
        text = content_of(file, MOST_BYTES).decode(errors="replace")
    except OSError:
        return file  # the reader of campaigns says what is wrong
    if re.search(r"^\[(safety|operational|human)[\].]", text, re.MULTILINE):
        raise UsageError.of(file, "", "is a persona, not a campaign", f"check it with: harness persona check {file}")
    if re.search(r"^kind *=", text, re.MULTILINE):
        raise UsageError.of(file, "", "is a driver, not a campaign", f"check it with: harness check-driver {file}")
    return file


def _check_campaign(file: Path, allow_code: bool, as_json: bool, console: Console) -> None:
    from harness.campaign.execution.repeat_check import varying_drivers
    from harness.campaign.plan.paper_rounds import family_lines, family_records, questions
    from harness.campaign.plan.persona_remarks import ego_persona_remarks, persona_remarks
    from harness.campaign.preflight import open_campaign
    from harness.config.campaign import LEARNED
    from harness.evaluation.planned_tests import families

    opened = open_campaign(file, allow_code=allow_code)
    varying = varying_drivers(opened)
    stages = opened.stages
    notes = opened.ego_driver.notes if opened.ego_driver is not None else ()
    ego = [] if opened.document.ego.driver == LEARNED else [messages.ego(opened), *notes]
    told = (*varying.items(), *opened.learned_elsewhere.items())
    ego = [plain(each) for each in (*ego, *(f"{driver}: {words}" for driver, words in told))]
    unsuited = persona_remarks([*opened.people.values()], opened.scene.world, opened.document.training.discount)
    remarks = [*opened.scene.warnings, *unsuited, *ego_persona_remarks(opened.ego_persona), *ego]
    print_plain([f"{file} is in order.", *remarks], console)
    personas = [each.name for each in opened.personas]
    planned = families(questions(opened.document, personas, opened.tunable))
    print_plain([messages.work(opened, stages), *messages.stage_lines(stages)], console)
    print_plain(family_lines(planned), console)
    if as_json:
        checked = {"campaign": opened.document.name, "file": str(file), "in_order": True}
        listed = {"stages": messages.stage_records(stages), "planned_tests": family_records(planned)}
        print_json({**checked, "remarks": remarks, **listed})


def schema(
    document: Annotated[
        str | None,
        typer.Argument(
            metavar="DOCUMENT", help="campaign, persona, scene, driver or perception.  [default: all, with --out]"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write DOCUMENT.schema.json into this folder.")
    ] = None,
) -> None:
    """Print the JSON Schema of a kind of document, or write one or all schemas. Editors use them to complete and check
    TOML files."""
    from harness.config.json_schema import DOCUMENTS, schema_text, write_schemas

    if out is not None:
        for written in write_schemas(out, document):
            print(written)
    elif document is not None:
        print(schema_text(document), end="")
    else:
        remedy = f"name one of {', '.join(DOCUMENTS)}, or write all of them with --out DIR"
        raise UsageError.of("harness schema", "DOCUMENT", "is missing", remedy)


def columns(
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the page to this file.")] = None,
) -> None:
    """Print what the columns of tables and traces are, as Markdown: unit, formula and source of each."""
    from harness.files import check_new_file, write_atomically
    from harness.reports.columns_page import columns_page

    if out is None:
        print(columns_page(), end="")
    else:
        check_new_file(out, "--out")
        write_atomically(out, columns_page().encode())


def check_driver(
    driver: Annotated[
        str,
        typer.Argument(
            metavar="DRIVER",
            help="A driver document, a policy's folder, the name of an installed or shipped driver or of a shipped "
            "policy (paper_merge/naive-seed11), or sumo.",
        ),
    ],
    scene: Annotated[Path, typer.Option(metavar="DIR", help="The scene of the games, a folder or a name.")] = Path(
        "merge"
    ),
    games: Annotated[int, typer.Option(min=2, max=1000, metavar="N", help="Games to play.")] = 3,
    allow_code: AllowCode = False,
) -> None:
    """Check that a driver conforms to the driver protocol, and list every violation.

    Plays seeded games twice, then all at once, and tells how long a campaign takes. Exit code 1: it does not conform.
    """
    from harness.assessment.conformance import check_named
    from harness.cli.driver_pace import pace_lines

    findings = check_named(driver, document_at(scene, "networks"), games, allow_code=allow_code)
    print_plain([*findings.lines(), *pace_lines(findings, driver)], console_of_any_encoding())
    if findings.violations:
        raise typer.Exit(FAILED)


@policy_app.command("export")
def export_policy(
    driver: Annotated[
        str,
        typer.Argument(
            metavar="DRIVER",
            help="A policy's folder, a shipped policy (paper_merge/naive-seed11), or a document of kind "
            "stable_baselines3.",
        ),
    ],
    out: Annotated[Path, typer.Argument(metavar="FILE", help="The new file: .onnx, or .pt for TorchScript.")],
    allow_code: AllowCode = False,
) -> None:
    """Write a policy as one network, which drives without the library that trained it.

    The file and a driver document for it are written; what exists is not overwritten.
    """
    from harness.drivers.external import find_driver
    from harness.drivers.network_export import KINDS, export_network
    from harness.files import check_new_file, write_atomically

    check_new_file(out)
    document = out.with_suffix(".toml")
    for file in (out, document):
        if file.exists():
            raise UsageError.of(file, "", "exists", "name another file")
    difference = export_network(find_driver(driver, Path("DRIVER"), key="", allow_code=allow_code), out)
    write_atomically(document, f'kind = "{KINDS[out.suffix.lower()]}"\nfile = "{out.name}"\n'.encode())
    print(
        f"{out}: decides as the policy does, within {difference:.1g} over random observations. As a driver: {document}"
    )
