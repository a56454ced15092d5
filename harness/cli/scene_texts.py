"""The files of a scene on a map: scene.toml, the route file and a campaign."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from jinja2 import Environment, PackageLoader, StrictUndefined

from harness.errors import plain
from harness.traffic.maps.candidates import CandidateKind
from harness.traffic.maps.open_map import OpenMap
from harness.traffic.maps.plans import GamePlan
from harness.traffic.network import KEPT_M

_ON_ROADS = ("speedy", "distracted")
_PERSONAS = {
    CandidateKind.MERGE: _ON_ROADS,
    CandidateKind.LANE_END: _ON_ROADS,
    CandidateKind.FOLLOWING: _ON_ROADS,
    CandidateKind.ZEBRA: ("jaywalker", "phone_walker"),
}
_EGO_WAITS = (CandidateKind.ZEBRA, CandidateKind.FOLLOWING)  # for the non-ego, which is before it or has priority
_MEANINGS = {
    CandidateKind.TURN_ACROSS: "the non-ego comes towards the ego and turns across its way",
    CandidateKind.CROSSING: "the non-ego crosses the ego's way",
    CandidateKind.ROUNDABOUT: "the non-ego enters a roundabout in front of the ego",
    CandidateKind.MERGE: "the non-ego joins the ego's road",
    CandidateKind.LANE_END: "the non-ego's lane ends beside the ego's",
    CandidateKind.ZEBRA: "the non-ego, on foot, crosses the ego's road on a marked crossing",
    CandidateKind.FOLLOWING: "the non-ego is ahead of the ego",
}


def scene_files(name: str, plan: GamePlan, opened: OpenMap, *, is_part: bool) -> dict[str, str]:
    """The texts of scene.toml and of the route file of a plan of a map, by the files' names. `is_part`: the scene's net
    is a part of the map."""
    values = {
        "name": name,
        "plan": plan,
        "part_m": KEPT_M if is_part else None,
        "time_limit_s": plan.time_limit_s(opened.reds_s),
        "source": plain(opened.source.name),
        "place": plain(opened.place_of(plan)),
        "meaning": _MEANINGS[plan.candidate.kind],
    }
    return {
        "scene.toml": _rendered("new_scene.toml.jinja", values),
        f"{name}.rou.xml": _rendered("new_scene.rou.xml.jinja", values, in_xml=True),
    }


def campaign_text(name: str, plan: GamePlan) -> str:
    """A campaign on a scene with the shipped personas that suit its kind."""
    kind = plan.candidate.kind
    values = {"name": name, "personas": personas_for(plan), "meaning": _MEANINGS[kind], "ego_waits": kind in _EGO_WAITS}
    return _rendered("new_scene_campaign.toml.jinja", values)


def personas_for(plan: GamePlan) -> Sequence[str]:
    """The shipped personas that suit a game."""
    signals = plan.candidate.kind is CandidateKind.CROSSING and plan.candidate.with_signals
    return ("red_light_runner",) if signals else _PERSONAS.get(plan.candidate.kind, ("impatient",))


def _rendered(template: str, values: Mapping[str, object], *, in_xml: bool = False) -> str:
    environment = Environment(
        loader=PackageLoader("harness", "cli"),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        autoescape=in_xml,
        trim_blocks=True,
    )
    environment.filters["toml"] = _toml
    return environment.get_template(template).render(values)


def _toml(value: object) -> str:
    """A value in TOML: a string, a number, or a list of them."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(float(str(value)))
