"""Make everything anew that the project publishes: policies, run folders, tables, the tables in documents.

    python docs/publish/publish.py --cost         # what it would take
    python docs/publish/publish.py                # the steps of docs/publish/published.toml, then the documents
    python docs/publish/publish.py --documents    # only the tables in documents, from the run folders that are there

A campaign continues where it was interrupted, and a finished one is not run again: so does this script.
"""

from __future__ import annotations

import gzip
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer
from cost import cost_table
from output_blocks import blocks_in, with_outputs
from pydantic import Field, model_validator

from harness.config.campaign import Campaign
from harness.config.toml_reading import Document, read_document
from harness.errors import NOT_ACCEPTED
from harness.evaluation.strategies import ManyPersonas, strategy_name
from harness.files import write_atomically

ROOT = Path(__file__).parents[2]
PUBLISHED = Path(__file__).with_name("published.toml")
LONG_TABLES = ("conduct", "episodes", "training")
DOCUMENTS = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
_SHIPPED_TRAININGS = 3


class Step(Document):
    """One step: a campaign to run, a file or folder to copy, or a command."""

    campaign: str = ""
    pack: bool = False
    """Whether the long tables of the campaign's run folder are published, compressed."""
    people: str = ""
    """The folder into which the policies of the campaign's personas are copied, for `harness league`."""
    copy_from: str = Field("", alias="copy")
    to: str = ""
    command: str = ""
    cost: str = ""
    """The cost of a command, in words."""

    @model_validator(mode="after")
    def _is_one_step(self) -> Step:
        if sum(map(bool, (self.campaign, self.copy_from, self.command))) != 1:
            raise ValueError("a step has one of `campaign`, `copy` and `command`")
        if bool(self.copy_from) != bool(self.to):
            raise ValueError("`copy` and `to` belong together")
        if (self.pack or self.people) and not self.campaign:
            raise ValueError("`pack` and `people` belong to a campaign")
        return self

    def __str__(self) -> str:
        return self.command or (
            f"copy {self.copy_from} to {self.to}" if self.to else f"harness campaign {self.campaign}"
        )


class Published(Document):
    """The document published.toml."""

    step: list[Step] = Field(min_length=1)


def main(
    cost: Annotated[bool, typer.Option("--cost", help="Print what the steps would take, and end.")] = False,
    documents: Annotated[bool, typer.Option("--documents", help="Only write the tables in documents anew.")] = False,
    only: Annotated[
        list[str] | None, typer.Option(metavar="TEXT", help="Only the steps and tables that contain this text.")
    ] = None,
) -> None:
    """Make everything anew that the project publishes, and say first what it costs."""
    chosen = only or [""]
    steps = [each for each in read_document(PUBLISHED, Published).step if any(text in str(each) for text in chosen)]
    if not documents:
        print(cost_table([ROOT / each.campaign for each in steps if each.campaign], ROOT))
        for each in steps:
            if each.cost:
                print(f"{each.command}: {each.cost}")
        if cost:
            return
        for number, step in enumerate(steps, 1):
            print(f"\nstep {number} of {len(steps)}: {step}", flush=True)
            carry_out(step, ROOT)
    for document in DOCUMENTS:
        write_outputs(document, ROOT, chosen)


def carry_out(step: Step, root: Path) -> None:
    """Carry out one step in a checkout. Raises CalledProcessError or OSError if it fails."""
    if step.campaign:
        run = root / "reports" / read_document(root / step.campaign, Campaign).name
        _run(f"harness campaign {step.campaign}", root, capture=False)
        if step.pack:
            pack(run)
        if step.people:
            _replace(root / step.people, people_of(run))
    elif step.command:
        _run(step.command, root, capture=False)
    else:
        _replace(root / step.to, sorted((root / step.copy_from).iterdir()))


def people_of(run: Path) -> list[Path]:
    """The policies of a run's personas from its first three trainings: the network of all of them for each seed, if
    they learned together. A league meets every one of them."""
    policies = run / "policies"
    together = sorted(policies.glob(f"{strategy_name(ManyPersonas(personas=()))}-seed*"))
    personas = json.loads((run / "manifest.json").read_bytes())["personas"]
    apart = [each for name in personas for each in sorted(policies.glob(f"{name}-seed*"))[:_SHIPPED_TRAININGS]]
    return together[:_SHIPPED_TRAININGS] or apart


def _replace(target: Path, sources: list[Path]) -> None:
    """Replace a folder by copies of other folders."""
    fresh = target.with_name(f"{target.name}.new")
    shutil.rmtree(fresh, ignore_errors=True)
    for each in sources:
        shutil.copytree(each, fresh / each.name)
    shutil.rmtree(target, ignore_errors=True)
    fresh.rename(target)


def pack(run: Path) -> None:
    """Compress the long tables of a run folder. Raises OSError if one is not there."""
    for name in LONG_TABLES:
        table = run / f"{name}.csv"
        write_atomically(run / f"{name}.csv.gz", gzip.compress(table.read_bytes(), mtime=0))


def write_outputs(document: Path, root: Path, chosen: list[str]) -> None:
    """Write the output of each of a document's commands that contain one of `chosen` anew.

    A command without its run folder is left out, and named. Raises CalledProcessError if a command fails.
    """
    text = document.read_text(encoding="utf-8")
    outputs: dict[str, str] = {}
    for command in blocks_in(text):
        missing = [word for word in command.split() if word.startswith("reports/") and not (root / word).exists()]
        if missing:
            print(f"{document.name}: left as it is, {missing[0]} is not there: {command}")
        elif any(each in command for each in chosen):
            outputs[command] = _run(command, root, capture=True)
    changed = with_outputs(text, outputs)
    if changed != text:
        write_atomically(document, changed.encode())
        print(f"{document.name}: written anew")


def _run(command: str, root: Path, capture: bool) -> str:
    program, *arguments = command.split()
    words = [sys.executable, *(arguments if program == "python" else ["-m", "harness.cli.main", *arguments])]
    output = subprocess.PIPE if capture else None
    done = subprocess.run(words, cwd=root, check=False, stdout=output, text=True, encoding="utf-8")
    if done.returncode != NOT_ACCEPTED:  # a run that does not keep its bounds is published like any other
        done.check_returncode()
    return done.stdout or ""


if __name__ == "__main__":
    typer.run(main)
