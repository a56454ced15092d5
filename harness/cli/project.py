"""`harness new`: a folder with a campaign, a scene and a persona of one's own, which run as they are."""

from __future__ import annotations

import shutil
from pathlib import Path

from harness.cli import messages
from harness.cli.new_documents import check_name, rendered
from harness.cli.persona_template import create_persona
from harness.errors import UsageError
from harness.files import write_atomically
from harness.shipped_documents import shipped

PERSONA = "my_driver"
SCENE = "merge"
_TEMPLATES = {"campaign.toml": "project_campaign.toml.jinja", "README.md": "project_readme.md.jinja"}


def create_project(folder: Path) -> list[Path]:
    """Write the files of a new project and return their paths. `folder` must not exist, or be empty.

    The campaign is named after the folder. Raises UsageError if the folder holds files, its name is not that of a
    campaign, or it can't be written.
    """
    name = folder.absolute().name
    check_name(name, "campaign")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError.of(folder, "", "is there already, and not empty", "name a new folder")
    if not folder.absolute().parent.is_dir():
        raise UsageError.of(folder, "", *messages.no_folder(folder.absolute().parent))
    try:
        (folder / "personas").mkdir(parents=True)
        shutil.copytree(shipped("networks") / SCENE, folder / "networks" / SCENE)
        persona = create_persona(PERSONA, folder / "personas" / f"{PERSONA}.toml")
        for file, template in _TEMPLATES.items():
            text = rendered(template, folder=name, persona=PERSONA, scene=SCENE)
            write_atomically(folder / file, text.encode())
    except OSError as error:
        raise UsageError.of(folder, "", *messages.cannot_write(error)) from None
    return [folder / "campaign.toml", folder / "networks" / SCENE / "scene.toml", persona, folder / "README.md"]
