"""A recorded game as an OpenSCENARIO 1.2 document: every body follows its recorded course.

Positions are those of the standard's reference points: of a vehicle the middle of its rear axle, of everything else the
middle of its body. The game's cars turn about the middle of the wheelbase, which is also the middle of the body.

A body that appears later is added by an event, and one that leaves is deleted half a step after its last sample. Both
players have a controller, which is not active: it is the place of another program's driver.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

import numpy as np
from scenariogeneration import xosc

from harness.export.exported_game import PERSON, THING, Body, ExportedGame
from harness.export.opendrive import NO_DATE, ROAD_FILE, RoadFile
from harness.replay.floating_car_data import xml_text
from harness.replay.scenery import phases_of

_LAMPS = {
    "r": "on;off;off",
    "u": "on;on;off",
    "y": "off;on;off",
    "Y": "off;on;off",
    "g": "off;off;on",
    "G": "off;off;on",
    "s": "on;off;off",
    "o": "off;flashing;off",
}
"""The modes of a signal's red, yellow and green lamps, by a link's state in SUMO."""
_OFF = "off;off;off"
_LIMITS = {"max_speed": 100.0, "max_acceleration": 50.0, "max_deceleration": 50.0}
"""Of every vehicle: wide enough for any recorded motion."""
_FOR_ESMINI = {"plineInterpolation": "segment"}
"""Property of every entity: esmini turns it evenly between two samples. By default it turns it around corners only, and
does not show the heading of a sample at its time."""
_WHEEL_M, _MAX_STEER_RAD = 0.6, 0.8


def scenario_file(game: ExportedGame, road: RoadFile | None) -> bytes:
    """The document of a game. Signals' states are in it if there is a `road`, whose signals they name."""
    entities, init = xosc.Entities(), xosc.Init()
    act = xosc.Act("recording", _at(0.0, "start of the recording"))
    network = xosc.RoadNetwork(ROAD_FILE if road is not None else None)
    for body in game.bodies:
        entities.add_scenario_object(body.name, _entity(body), _controller(body) if body.is_player else None)
        if body.first_step == 0:
            for action in _start(body):
                init.add_init_action(body.name, action)
        events = list(_events(body, game))
        if events:
            act.add_maneuver_group(_group(body.name, events))
    if road is not None:
        changes = list(_signal_events(game, road))
        if changes:
            act.add_maneuver_group(_group("signals", changes, actors=()))
        for controller in _signal_controllers(game, road):
            network.add_traffic_signal_controller(controller)
    end = _at(game.end_s + 0.5 * game.step_s, "end of the recording", starts=False)
    board = xosc.StoryBoard(init, end)
    story = xosc.Story("recorded game")
    story.add_act(act)
    board.add_story(story)
    scenario = xosc.Scenario(
        game.title,
        "harness",
        xosc.ParameterDeclarations(),
        entities,
        board,
        network,
        xosc.Catalog(),
        osc_minor_version=2,
        creation_date=datetime.fromisoformat(NO_DATE),
    )
    return xml_text(scenario.get_element())


def _entity(body: Body) -> xosc.Vehicle | xosc.Pedestrian | xosc.MiscObject:
    kind, name = body.kind, f"{body.kind.word}_of_{body.name}"
    box = xosc.BoundingBox(body.width_m, body.length_m, kind.height_m, 0.5 * body.wheelbase_m, 0.0, 0.5 * kind.height_m)
    if kind.group == PERSON:
        category = xosc.PedestrianCategory.pedestrian
        entity: Any = xosc.Pedestrian(name, kind.mass_kg, category, box, model=kind.word)
    elif kind.group == THING:
        entity = xosc.MiscObject(name, kind.mass_kg, getattr(xosc.MiscObjectCategory, kind.word), box)
    else:
        track_m = 0.0 if kind.two_wheeled else 0.85 * body.width_m
        front, rear = (
            xosc.Axle(steer, _WHEEL_M, track_m, x_m, 0.5 * _WHEEL_M)
            for steer, x_m in ((_MAX_STEER_RAD, body.wheelbase_m), (0.0, 0.0))
        )
        category = getattr(xosc.VehicleCategory, kind.word)
        entity = xosc.Vehicle(name, category, box, front, rear, mass=kind.mass_kg, **_LIMITS)
    for name, value in _FOR_ESMINI.items():
        entity.add_property(name, value)
    if body.name == "ego":
        entity.add_property("type", "ego_vehicle")
    if body.original != body.name:
        entity.add_property("recorded_as", body.original)
    return entity


def _controller(body: Body) -> xosc.Controller:
    """The controller of a player, which esmini knows as one that another program steers."""
    properties = xosc.Properties()
    properties.add_property("esminiController", "ExternalController")
    return xosc.Controller(f"{body.name}_controller", properties)


def _start(body: Body) -> Iterator[Any]:
    yield xosc.TeleportAction(_positions(body)[0])
    if body.kind.group != THING:
        at_once = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0.0)
        yield xosc.AbsoluteSpeedAction(float(body.speed_mps[0]), at_once)


def _events(body: Body, game: ExportedGame) -> Iterator[xosc.Event]:
    begin_s, last_s = float(body.time_s[0]), float(body.time_s[-1])
    appears, follows = body.first_step > 0, body.moves and len(body.time_s) > 1
    if appears or follows:
        event = _event("follows its course" if follows else "appears", begin_s)
        if appears:
            event.add_action("appear", xosc.AddEntityAction(body.name, _positions(body)[0]))
        if follows:
            event.add_action("follow", _course(body))
        yield event
    if body.leaves:
        event = _event("leaves", last_s + 0.5 * game.step_s)
        event.add_action("leave", xosc.DeleteEntityAction(body.name))
        yield event


def _course(body: Body) -> xosc.FollowTrajectoryAction:
    course = xosc.Trajectory(f"course of {body.name}", closed=False)
    course.add_shape(xosc.Polyline(np.round(body.time_s, 6).tolist(), _positions(body)))
    return xosc.FollowTrajectoryAction(course, xosc.FollowingMode.position, xosc.ReferenceContext.absolute, 1, 0)


def _positions(body: Body) -> list[xosc.WorldPosition]:
    """The place of the body's reference point in each sample."""
    back_m, heading_rad = 0.5 * body.wheelbase_m, body.heading_rad
    places_m = body.x_m - back_m * np.cos(heading_rad), body.y_m - back_m * np.sin(heading_rad)
    poses = np.column_stack((*places_m, heading_rad)).round(6).tolist()
    return [xosc.WorldPosition(x_m, y_m, h=turned_rad) for x_m, y_m, turned_rad in poses]


def _signal_events(game: ExportedGame, road: RoadFile) -> Iterator[xosc.Event]:
    """An event for each time in which a light's state changes, with an action for each signal of the light."""
    changes = [(time_s, light, state) for light, each in game.signals.items() for time_s, state in each]
    for time_s, light, state in sorted(changes):
        if shown := _shown(road.signals.get(light, {}), state):
            event = _event(f"{light} at {time_s:.2f} s", time_s)
            for number, lamps in shown:
                event.add_action(f"signal {number}", xosc.TrafficSignalStateAction(str(number), lamps))
            yield event


def _signal_controllers(game: ExportedGame, road: RoadFile) -> Iterator[xosc.TrafficSignalController]:
    for light, changes in game.signals.items():
        numbers = road.signals.get(light, {})
        controller = xosc.TrafficSignalController(light)
        for place, (duration_s, state) in enumerate(phases_of(changes)):
            phase = xosc.Phase(f"{light}_{place}", round(duration_s, 6))
            for number, lamps in _shown(numbers, state):
                phase.add_signal_state(str(number), lamps)
            controller.add_phase(phase)
        if numbers:
            yield controller


def _shown(numbers: Mapping[int, int], state: str) -> list[tuple[int, str]]:
    """The numbers of a light's signals and the modes of their lamps, by the state of each link."""
    return [(numbers[link], _LAMPS.get(each, _OFF)) for link, each in enumerate(state) if link in numbers]


def _group(name: str, events: Sequence[xosc.Event], actors: Sequence[str] | None = None) -> xosc.ManeuverGroup:
    group, maneuver = xosc.ManeuverGroup(f"group of {name}"), xosc.Maneuver(f"maneuver of {name}")
    for actor in (name,) if actors is None else actors:
        group.add_actor(actor)
    for event in events:
        maneuver.add_event(event)
    group.add_maneuver(maneuver)
    return group


def _event(name: str, time_s: float) -> xosc.Event:
    event = xosc.Event(name, xosc.Priority.parallel)
    event.add_trigger(_at(time_s, f"{name} at {time_s:.3f} s"))
    return event


def _at(time_s: float, name: str, *, starts: bool = True) -> xosc.ValueTrigger:
    when = xosc.SimulationTimeCondition(round(time_s, 6), xosc.Rule.greaterOrEqual)
    return xosc.ValueTrigger(name, 0, xosc.ConditionEdge.none, when, "start" if starts else "stop")
