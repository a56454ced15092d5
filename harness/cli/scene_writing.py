"""Writing scenes and campaigns on a map: each is checked, and complete before it gets its name."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from harness.cli import wording
from harness.cli.scene_texts import campaign_text, scene_files
from harness.config.scene import Name
from harness.errors import Problem, UsageError
from harness.files import make_folder, write_atomically
from harness.traffic.load_check import check_loads
from harness.traffic.maps.net_part import write_part
from harness.traffic.maps.open_map import OpenMap
from harness.traffic.maps.plans import GamePlan
from harness.traffic.scene import open_scene

_SCRATCH = ".part"


def check_new(name: str, names: Sequence[str], out: Path) -> None:
    """Raise UsageError if scenes and campaigns of these names can't be written to a folder."""
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        raise UsageError.of("NAME", name, *wording.BAD_SCENE_NAME) from None
    if not out.is_dir():
        raise UsageError.of("--out", str(out), *wording.no_folder(out))
    taken = [path for each in names for path in files_of(each, out) if os.path.lexists(path)]
    if taken:
        raise UsageError([Problem(str(path), "", *wording.SCENE_EXISTS) for path in taken])


def files_of(name: str, out: Path) -> tuple[Path, Path]:
    """The folder of a scene, and the file of its campaign."""
    return out / "networks" / name, out / "campaigns" / f"{name}.toml"


def write_scenes(opened: OpenMap, chosen: dict[str, GamePlan], out: Path) -> tuple[list[str], list[Problem]]:
    """Write a scene and a campaign for each name; each scene is checked as `harness check` does.

    Returns the names that were written, and the problems of those that were not. Nothing is half written: every file is
    complete before the first one gets its name. Raises UsageError if no scene can be written.
    """
    problems: list[Problem] = []
    with tempfile.TemporaryDirectory(prefix="harness-map-") as folder:
        ready: dict[str, Path] = {}
        for name, plan in chosen.items():
            try:
                ready[name] = _checked(opened, name, plan, Path(folder))
            except UsageError as error:
                problems += [
                    Problem(f"conflict {plan.number}", each.key, each.message, each.remedy) for each in error.problems
                ]
        if not ready:
            raise UsageError(problems)
        try:
            _put(opened, {name: (path, chosen[name]) for name, path in ready.items()}, out)
        except OSError as error:
            raise UsageError.of(out, "", *wording.cannot_write(error)) from None
    return list(ready), problems


def _checked(opened: OpenMap, name: str, plan: GamePlan, folder: Path) -> Path:
    """The folder of a scene, which is in order, in a folder."""
    scene = folder / name
    scene.mkdir()
    is_part = write_part(opened.net, opened.net_file, plan.edges, scene / f"{name}.net.xml")
    for file, text in scene_files(name, plan, opened, is_part=is_part).items():
        (scene / file).write_text(text, encoding="utf-8")
    check_loads(open_scene(scene))
    return scene


def _put(opened: OpenMap, ready: dict[str, tuple[Path, GamePlan]], out: Path) -> None:
    """Move complete scenes to their places, each under its name at once, and write their campaigns."""
    for kind in ("networks", "campaigns"):
        make_folder(out / kind)
    scratch = {name: out / "networks" / f".{name}{_SCRATCH}" for name in ready}
    done: list[Path] = []
    try:
        for name, (path, _) in ready.items():
            shutil.copytree(path, scratch[name])
        for name, (_, plan) in ready.items():
            folder, campaign = files_of(name, out)
            os.rename(scratch[name], folder)
            done.append(folder)
            write_atomically(campaign, campaign_text(name, plan).encode())
            done.append(campaign)
    except BaseException:
        for each in done:
            shutil.rmtree(each) if each.is_dir() else each.unlink(missing_ok=True)
        raise
    finally:
        for each in scratch.values():
            shutil.rmtree(each, ignore_errors=True)
