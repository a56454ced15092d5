"""A league: one ego against all people on all roads. For each scene there is a campaign, in which nothing is trained.

    <folder>/campaigns/<scene>.toml   the campaign of a scene
    <folder>/egos/<name>.toml         the ego's document, without the parameters that a search may change
    <folder>/<scene>/                 its run folder

People of other training seeds than the first ones, and those of another kind of policy, have a campaign of their own,
`<scene>-seed<n>`.
"""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import tomli_w

from harness.campaign.preflight import OpenCampaign, open_campaign
from harness.campaign.shipped_people import people_of
from harness.config.campaign import LEARNED, SUMO
from harness.config.driver import DriverDocument, Onnx, Process, StableBaselines3, TorchScript
from harness.config.tunable import Adjustable
from harness.drivers.external import find_driver
from harness.drivers.sb3_policy import saved_by
from harness.errors import Problem, UsageError, collect
from harness.files import make_folder, write_atomically
from harness.shipped_documents import find_document, missing_document, shipped, shipped_names

_CAMPAIGNS, _EGOS = "campaigns", "egos"
_OPTION = "--ego"


def open_league(
    ego: str,
    scenes: Sequence[str],
    folder: Path,
    *,
    episodes: int,
    shield: str | None = None,
    allow_code: bool = False,
) -> list[OpenCampaign]:
    """Write the campaigns of a league into its folder, and open them. `scenes` are names or folders; none: every
    shipped scene. With a `shield`, the ego plays each game with it too. Raises UsageError with every problem found."""
    if folder.exists() and not folder.is_dir():
        raise UsageError.of("--out", str(folder), "is a file", "name a folder")
    problems: list[Problem] = []
    names = scenes or shipped_names("networks")
    found = list(dict.fromkeys(collect(problems, partial(_scene_at, each)) for each in names))
    problems += _same_names([each for each in found if each is not None])
    driver = collect(problems, partial(_driver, ego, folder / _EGOS, allow_code))
    if ego == SUMO and shield is not None:
        message = "SUMO drives this ego, and has no decision that a shield could check"
        problems.append(Problem("--shield", "", message, "leave it out, or name another ego"))
    if problems or driver is None:
        raise UsageError(problems)
    opened = []
    for scene in filter(None, found):
        for campaign in _campaigns(scene, {"driver": driver} | ({"shield": shield} if shield else {}), episodes):
            file = folder / _CAMPAIGNS / f"{campaign['name']}.toml"
            make_folder(file.parent)
            write_atomically(file, tomli_w.dumps(campaign).encode())
            opened.append(collect(problems, partial(open_campaign, file, allow_code=allow_code)))
    if problems:
        raise UsageError(problems)
    return [each for each in opened if each is not None]


def name_of(ego: str) -> str:
    """A short name of an ego of the command line: that of its file; of a command, that of the first file among its
    arguments, or of its program. Raises UsageError as `open_league` does, if it is none of them."""
    program, *arguments = _words(ego)
    return Path(next((each for each in arguments if Path(each).is_file()), program)).stem


def _words(ego: str) -> list[str]:
    """The words of an ego of the command line: one, if it is a file."""
    if os.path.exists(ego):
        return [ego]
    try:
        words = shlex.split(ego)
    except ValueError as error:
        message = f"{ego!r} is no file, and as a command it has a mistake: {error}"
        raise UsageError.of(_OPTION, "", message, "write quotation marks in pairs") from None
    if not words:
        raise UsageError.of(_OPTION, "", f"{ego!r} names no ego", "name one, such as adas")
    return words


def _scene_at(written: str) -> Path:
    place = find_document(written, Path(), "networks")
    if not place.is_dir():
        raise UsageError.of("--scenes", "", *missing_document(written, Path(), "networks"))
    return place


def _same_names(scenes: Sequence[Path]) -> Iterator[Problem]:
    """A problem for each scene with the name of one before it: both would have one run folder."""
    of_name = dict[str, Path]()
    for scene in scenes:
        if (first := of_name.setdefault(scene.name, scene)) != scene:
            message = f"{first} and {scene} have the same name"
            yield Problem("--scenes", "", message, "rename one of the folders, or play each in a league of its own")


def _campaigns(scene: Path, ego: Mapping[str, str], episodes: int) -> Iterator[Mapping[str, Any]]:
    shared = {"scene": str(scene), "ego": ego, "assessment": {"episodes": episodes}}
    people = people_of(scene)
    if not people:
        yield {"name": scene.name, "personas": [], **shared}
    for number, each in enumerate(people):
        name = f"{scene.name}-seed{'-'.join(map(str, each.seeds))}" if number else scene.name
        own = {"personas": each.personas, "seeds": each.seeds, "policies": str(shipped("policies") / scene.name)}
        how = {"non_ego_training": {"together": True}} if each.together else {}
        yield {"name": name, **own, **how, **shared}


def _driver(ego: str, folder: Path, allow_code: bool) -> str:
    """What the campaigns call an ego of the command line. Its document, if it has one, is written into the folder."""
    if ego == LEARNED:
        message = f"{ego!r} is trained by a campaign, and a league trains nothing"
        raise UsageError.of(_OPTION, "", message, "name a policy, such as paper_merge/naive-seed11")
    if ego == SUMO:
        return ego
    document = _seen(ego)
    if document is None:
        driver = find_driver(ego, Path(_OPTION), "", allow_code)
        if driver.document is None:
            return str(driver.place)
        document = driver.document_in(folder)
    if isinstance(document, Adjustable):
        document = document.model_copy(update={"tunable": {}})  # nothing is searched
    file = folder / f"{name_of(ego)}.toml"
    make_folder(folder)
    write_atomically(file, document.toml(f"The ego of a league: {ego}").encode())
    find_driver(str(file.resolve()), Path(_OPTION), "", allow_code)
    return f"../{_EGOS}/{file.name}"


def _seen(ego: str) -> DriverDocument | None:
    """The document of an ego whose kind can be seen: a network, a policy of Stable-Baselines3, or a command."""
    path = Path(ego).absolute()
    match path.suffix.lower():
        case ".onnx" if path.is_file():
            return Onnx(kind="onnx", file=str(path))
        case ".pt" if path.is_file():
            return TorchScript(kind="torchscript", file=str(path))
        case ".zip" if path.is_file():
            algorithm = saved_by(path)
            if algorithm is None:
                message = f"{ego!r} does not tell which algorithm of Stable-Baselines3 saved it"
                raise UsageError.of(
                    _OPTION, "", message, "name a driver document with its `algorithm` (docs/egos-by-networks.md)"
                )
            return StableBaselines3.model_validate(
                {"kind": "stable_baselines3", "file": str(path), "algorithm": algorithm}
            )
    command = _words(ego)
    if len(command) > 1 and shutil.which(command[0]):
        return Process(kind="process", command=command, folder=str(Path.cwd()))
    if path.is_file() and os.access(path, os.X_OK) and path.suffix.lower() not in (".toml", ".fmu"):
        return Process(kind="process", command=[str(path)], folder=str(Path.cwd()))
    return None
