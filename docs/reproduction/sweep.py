"""Sweep the levers of the reproduction: each setting is its own campaign, run by the code of `harness campaign`.

    python docs/reproduction/sweep.py docs/reproduction/levers.toml

reads the levers (document, key, values), runs one campaign per value into its own run folder, and writes one row per
setting and arm. An interrupted sweep continues where it stopped.
"""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import tomlkit
import typer
from pydantic import Field
from rich.console import Console

from harness.campaign.execution.run_campaign import run_campaign
from harness.campaign.execution.worker_pool import WorkerPool, cores
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.config.toml_reading import Document, read_document
from harness.shipped_documents import find_document

COLUMNS = [
    *("persona", "key", "value", "arm", "episodes", "failure_rate", "mean_speed_mps"),
    *("non_ego_goal_rate", "non_ego_mean_speed_mps", "training_steps"),
]


class Lever(Document):
    """One key of one persona and its values; everything else stays as shipped."""

    persona: str
    """The persona's file, relative to this document."""
    key: str
    """Dotted, as in `safety.terms.collision`. With the prefix `campaign.` it is a key of the campaign itself, with
    `ego.` one of the ego's own persona."""
    values: list[Any] = Field(min_length=1)


class Sweep(Document):
    """The document of a sweep."""

    campaign: str
    """The campaign that all settings are variants of, relative to this document."""
    levers: list[Lever] = Field(min_length=1)


@dataclass(frozen=True)
class Setting:
    """One value of one lever: one campaign."""

    lever: Lever
    value: Any

    @property
    def name(self) -> str:
        persona = Path(self.lever.persona).stem
        word = f"{persona}-{self.lever.key}-{self.value}"
        return "".join(letter if letter.isalnum() or letter in "-." else "_" for letter in word).strip("_")


def main(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The levers, such as docs/reproduction/levers.toml.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder for the run folders.")] = Path("reports/sweep"),
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="The table.  [default: beside FILE]")] = None,
) -> None:
    """Run all settings that are not finished, and write the table of all settings."""
    console = Console()
    sweep = read_document(file, Sweep)
    settings = [Setting(lever, value) for lever in sweep.levers for value in lever.values]
    rows: list[pd.DataFrame] = []
    for number, setting in enumerate(settings, 1):
        console.rule(f"{number} of {len(settings)}: {setting.name}")
        folder = out / setting.name
        campaign = _write_campaign(file.parent, sweep, setting, out / "documents" / setting.name)
        run_campaign(open_campaign(campaign), RunFolder(folder), partial(WorkerPool, jobs=cores()), console)
        rows.append(_rows(folder, setting))
        pd.concat(rows)[COLUMNS].to_csv(table or file.with_suffix(".csv"), index=False)
        for heavy in ("traces", "replays", "tensorboard"):
            shutil.rmtree(folder / heavy, ignore_errors=True)


def _write_campaign(base: Path, sweep: Sweep, setting: Setting, folder: Path) -> Path:
    """Write the campaign's documents, with one value changed, into their own folder. Returns the campaign's file."""
    folder.mkdir(parents=True, exist_ok=True)
    source = base / sweep.campaign
    campaign = tomlkit.parse(source.read_text(encoding="utf-8"))
    ego: Any = campaign["ego"]
    files = {
        "": (base / setting.lever.persona).resolve(),
        "ego": find_document(str(ego["persona"]), source.parent, "personas"),
    }
    prefix, _, key = setting.lever.key.partition(".")
    changed = prefix if prefix in ("campaign", "ego") else ""
    for name, file in files.items():
        persona = tomlkit.parse(file.read_text(encoding="utf-8"))
        if name == changed:
            _put(persona, key if changed else setting.lever.key, setting.value)
        (folder / file.name).write_text(tomlkit.dumps(persona), encoding="utf-8")
    if changed == "campaign":
        _put(campaign, key, setting.value)
    campaign["name"] = "sweep"
    campaign["seeds"] = [1]
    campaign["personas"] = [files[""].name]
    ego["persona"] = files["ego"].name
    campaign["scene"] = _relative(source, str(campaign["scene"]), folder)
    file = folder / "campaign.toml"
    file.write_text(tomlkit.dumps(campaign), encoding="utf-8")
    return file


def _relative(source: Path, written: str, folder: Path) -> str:
    return Path(os.path.relpath((source.parent / written).resolve(), folder.resolve())).as_posix()


def _put(document: Any, key: str, value: Any) -> None:
    *tables, last = key.split(".")
    for name in tables:
        if name not in document:
            document[name] = tomlkit.table()
        document = document[name]
    document[last] = value


def _rows(folder: Path, setting: Setting) -> pd.DataFrame:
    """The results of a setting, one row per arm, from the tables of its run folder."""
    summary = pd.read_csv(folder / "summary.csv")
    episodes = pd.read_csv(folder / "episodes.csv")
    by_arm = episodes.groupby("arm")
    goals = by_arm["non_ego_outcome"].apply(
        lambda outcome: (outcome == "goal").mean() if outcome.notna().any() else None
    )
    steps = pd.read_csv(folder / "training.csv").groupby("stage")["steps"].max()
    trained = {"naive_alone": "naive", f"retrained_vs_{_persona(setting)}": f"retrained_{_persona(setting)}"}
    frame = summary.assign(
        persona=_persona(setting),
        key=setting.lever.key,
        value=str(setting.value),
        non_ego_goal_rate=summary["arm"].map(goals),
        non_ego_mean_speed_mps=summary["arm"].map(by_arm["non_ego_mean_speed_mps"].mean()),
        training_steps=summary["arm"].map(lambda arm: steps.get(trained.get(arm, _persona(setting)))),
    )
    return frame


def _persona(setting: Setting) -> str:
    return Path(setting.lever.persona).stem


if __name__ == "__main__":
    typer.run(main)
