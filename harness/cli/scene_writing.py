"""Writing scenes and campaigns on a map: scene.toml, the route file and a campaign of each. Each is checked, and
complete before it gets its name."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from markupsafe import Markup

from harness.assessment.route_trial import check_routes
from harness.cli.new_documents import check_free, check_name, rendered
from harness.errors import Problem, UsageError, plain
from harness.files import cannot_write, make_folder, no_folder, scratch_beside, write_atomically
from harness.maps.candidates import CandidateKind
from harness.maps.game_plans import GamePlan
from harness.maps.map_traffic import SceneTraffic, scene_traffic
from harness.maps.open_map import OpenMap, write_part
from harness.road.net.network import KEPT_M
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import open_scene

_PERSONAS = {  # none that lets go of the wheel, as `texting` does: it leaves every road that bends
    CandidateKind.MERGE: ("speedy", "late_merger"),
    CandidateKind.LANE_END: ("speedy", "late_merger"),
    CandidateKind.FOLLOWING: ("speedy", "tailgater"),
    CandidateKind.ZEBRA: ("jaywalker", "phone_walker"),
}
_MEANINGS = {
    CandidateKind.TURN_ACROSS: "the non-ego comes towards the ego and turns across its way",
    CandidateKind.CROSSING: "the non-ego crosses the ego's way",
    CandidateKind.ROUNDABOUT: "the non-ego enters a roundabout in front of the ego",
    CandidateKind.MERGE: "the non-ego joins the ego's road",
    CandidateKind.LANE_END: "the non-ego's lane ends beside the ego's",
    CandidateKind.ZEBRA: "the non-ego, on foot, crosses the ego's road on a marked crossing",
    CandidateKind.FOLLOWING: "the non-ego is ahead of the ego",
}


def check_new(name: str, names: Sequence[str], out: Path) -> None:
    """Raise UsageError if scenes and campaigns of these names can't be written to a folder."""
    check_name(name, "scene")
    if not out.is_dir():
        raise UsageError.of("--out", str(out), *no_folder(out))
    paths = (path for each in names for path in files_of(each, out))
    check_free(paths, "choose another NAME, or --out another folder")


def files_of(name: str, out: Path) -> tuple[Path, Path]:
    """The folder of a scene, and the file of its campaign."""
    return out / "networks" / name, out / "campaigns" / f"{name}.toml"


def write_scenes(
    opened: OpenMap,
    chosen: Mapping[str, Sequence[GamePlan]],
    out: Path,
    on_plan: Callable[[GamePlan], None] = lambda plan: None,
) -> tuple[dict[str, GamePlan], list[Problem]]:
    """Write a scene and a campaign for each name, of the first of its plans that is in order: `harness check` accepts
    the scene, and a rule-based driver can drive its routes. `on_plan` gets each plan before its check.

    Returns the plans that were written, by name, and the problems of the others. Nothing is half written: every file
    is complete before the first one gets its name. Raises UsageError if no scene can be written.
    """
    problems: list[Problem] = []
    with tempfile.TemporaryDirectory(prefix="harness-map-") as folder:
        ready: dict[str, tuple[Path, GamePlan]] = {}
        for name, plans in chosen.items():
            for plan in plans:
                on_plan(plan)
                try:
                    ready[name] = _checked(opened, name, plan, Path(folder)), plan
                    break
                except UsageError as error:
                    shutil.rmtree(Path(folder, name))
                    subject = f"conflict {plan.number}"
                    problems += [Problem(subject, each.key, each.message, each.remedy) for each in error.problems]
        if not ready:
            raise UsageError(problems)
        try:
            _put(opened, ready, out)
        except OSError as error:
            raise UsageError.of(out, "", *cannot_write(error)) from None
    return {name: plan for name, (_, plan) in ready.items()}, problems


def _checked(opened: OpenMap, name: str, plan: GamePlan, folder: Path) -> Path:
    scene = folder / name
    scene.mkdir()
    net_file = scene / f"{name}.net.xml"
    junctions = write_part(opened.net, opened.net_file, plan.edges, net_file, whole_net=opened.whole_net)
    traffic = None if opened.traffic is None else scene_traffic(opened.traffic, opened.net, junctions)
    for file, text in _scene_files(name, plan, opened, traffic, is_part=junctions is not None).items():
        (scene / file).write_text(text, encoding="utf-8")
    opened_scene = open_scene(scene)
    check_loads(opened_scene)
    check_routes(opened_scene, "choose another conflict")
    return scene


def _put(opened: OpenMap, ready: dict[str, tuple[Path, GamePlan]], out: Path) -> None:
    """Move complete scenes to their places, each under its name at once, and write their campaigns."""
    for kind in ("networks", "campaigns"):
        make_folder(out / kind)
    scratch = {name: scratch_beside(files_of(name, out)[0]) for name in ready}
    done: list[Path] = []
    try:
        for name, (path, _) in ready.items():
            shutil.copytree(path, scratch[name])
        for name, (_, plan) in ready.items():
            folder, campaign = files_of(name, out)
            os.rename(scratch[name], folder)
            done.append(folder)
            write_atomically(campaign, _campaign_text(name, plan).encode())
            done.append(campaign)
    except BaseException:
        for each in done:
            shutil.rmtree(each) if each.is_dir() else each.unlink(missing_ok=True)
        raise
    finally:
        for each in scratch.values():
            shutil.rmtree(each, ignore_errors=True)


def _scene_files(
    name: str, plan: GamePlan, opened: OpenMap, traffic: SceneTraffic | None, *, is_part: bool
) -> dict[str, str]:
    """The texts of scene.toml and of the route file of a plan of a map, by the files' names. `is_part`: the scene's net
    is a part of the map."""
    elements = [] if traffic is None else traffic.elements
    scene = rendered(
        "new_scene.toml.jinja",
        name=name,
        plan=plan,
        part_m=KEPT_M if is_part else None,
        traffic_begin_s=None if traffic is None else math.floor(traffic.begin_s),
        time_limit_s=plan.time_limit_s(opened.reds_s),
        red_s=plan.longest_red_s(opened.reds_s),
        source=plain(opened.source.name),
        place=plain(opened.place_of(plan)),
        meaning=_MEANINGS[plan.candidate.kind],
    )
    lines = [ElementTree.tostring(each, encoding="unicode").strip() for each in elements]
    routes = rendered("new_scene.rou.xml.jinja", in_xml=True, plan=plan, traffic=[Markup(line) for line in lines])
    return {"scene.toml": scene, f"{name}.rou.xml": routes}


def _campaign_text(name: str, plan: GamePlan) -> str:
    kind = plan.candidate.kind
    signals = kind is CandidateKind.CROSSING and plan.candidate.with_signals
    return rendered(
        "new_scene_campaign.toml.jinja",
        name=name,
        personas=("red_light_runner",) if signals else _PERSONAS.get(kind, ("impatient",)),
        meaning=_MEANINGS[kind],
    )
