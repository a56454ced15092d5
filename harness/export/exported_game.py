"""A recorded game as what exports write: bodies with their courses, and the signals' states.

A road user that was absent for a while is one body for each of its presences.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import shapely

from harness.game.arrays import FloatArray
from harness.replay.scenery import changes_of_signals
from harness.replay.vehicles import DrawnVehicle, presences, types_of_vehicles
from harness.road.scene.open_scene import OpenScene

VEHICLE, PERSON, THING = "vehicle", "person", "thing"


@dataclass(frozen=True, kw_only=True)
class ExportedKind:
    """A kind of road user or thing. Traces have no heights and masses: those of a kind are typical ones."""

    word: str
    group: str
    """VEHICLE, PERSON or THING."""
    height_m: float
    mass_kg: float
    two_wheeled: bool = False


CAR = ExportedKind(word="car", group=VEHICLE, height_m=1.5, mass_kg=1500.0)
VAN = ExportedKind(word="van", group=VEHICLE, height_m=2.5, mass_kg=3000.0)
TRUCK = ExportedKind(word="truck", group=VEHICLE, height_m=3.5, mass_kg=12000.0)
BUS = ExportedKind(word="bus", group=VEHICLE, height_m=3.2, mass_kg=12000.0)
TRAM = ExportedKind(word="tram", group=VEHICLE, height_m=3.5, mass_kg=30000.0)
MOTORBIKE = ExportedKind(word="motorbike", group=VEHICLE, height_m=1.5, mass_kg=250.0, two_wheeled=True)
BICYCLE = ExportedKind(word="bicycle", group=VEHICLE, height_m=1.7, mass_kg=90.0, two_wheeled=True)
PEDESTRIAN = ExportedKind(word="pedestrian", group=PERSON, height_m=1.75, mass_kg=75.0)
OBSTACLE = ExportedKind(word="obstacle", group=THING, height_m=1.0, mass_kg=100.0)
BUILDING = ExportedKind(word="building", group=THING, height_m=6.0, mass_kg=100000.0)

_BY_SHAPE = {
    "": OBSTACLE,
    "bicycle": BICYCLE,
    "bus": BUS,
    "delivery": VAN,
    "emergency": VAN,
    "firebrigade": TRUCK,
    "moped": MOTORBIKE,
    "motorcycle": MOTORBIKE,
    "pedestrian": PEDESTRIAN,
    "rail": TRAM,
    "scooter": MOTORBIKE,
    "truck": TRUCK,
    "wheelchair": PEDESTRIAN,
}


def kind_of_shape(shape: str) -> ExportedKind:
    """The kind of a body by SUMO's `guiShape`; empty stands for an obstacle that is no vehicle."""
    return _BY_SHAPE.get(shape.partition("/")[0], CAR)


WHEELBASE_SHARE = 0.6
"""Wheelbase of a vehicle of the background traffic, as a share of its length; players have one in their scene."""
_NOT_IN_NAMES = re.compile(r"[^\w.:#-]")
_NOT_IN_FILES = re.compile(r"[^\w.-]|^\.+")


@dataclass(frozen=True, kw_only=True)
class Body:
    """A road user or a thing during one presence in the game. Poses [n] are those of the body's centre."""

    name: str
    """Unique in the game; without characters that have a meaning in OpenSCENARIO."""
    original: str
    """The name in the trace."""
    kind: ExportedKind
    length_m: float
    width_m: float
    wheelbase_m: float
    """0 for bodies without wheels."""
    is_player: bool
    first_step: int
    time_s: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    """Without jumps of a whole turn."""
    speed_mps: FloatArray
    leaves: bool
    """Whether it is gone before the game ends."""

    @property
    def moves(self) -> bool:
        """Whether its pose changes."""
        return any(bool(np.ptp(values) > 0.0) for values in (self.x_m, self.y_m, self.heading_rad))


@dataclass(frozen=True, kw_only=True)
class ExportedGame:
    """A recorded game: the players first, then other road users by the time of their appearance, then buildings."""

    name: str
    """The name of its files, which is no path."""
    title: str
    arm: str
    seed: int
    episode: int
    outcome: str
    step_s: float
    end_s: float
    bodies: tuple[Body, ...]
    signals: Mapping[str, Sequence[tuple[float, str]]]
    """Of each traffic light: the times (s) at which its state changes, the first at 0 s, and the new states, with a
    character of SUMO's for each of its links."""


def exported_game(
    trace: pd.DataFrame, scene: OpenScene, *, name: str, arm: str, seed: int, episode: int, outcome: str
) -> ExportedGame:
    """One game from its trace (columns as in `traces/`) and the scene that it was played on.

    Raises ValueError for a trace without rows.
    """
    if trace.empty:
        raise ValueError(f"the trace of {name} has no rows")
    world = scene.world
    types = types_of_vehicles(trace, scene.routes.types_xml, scene.obstacles)
    wheelbases_m = dict(zip(world.roles, world.actuators.wheelbase_m.tolist(), strict=True))
    end_s = float(trace["time_s"].max())
    bodies = [*_bodies(trace, types, wheelbases_m, world.roles), *_buildings(scene.obstacles.outlines, end_s)]
    return ExportedGame(
        name=_NOT_IN_FILES.sub("_", name),
        title=f"{arm}, seed {seed}, episode {episode}: {outcome}",
        arm=arm,
        seed=seed,
        episode=episode,
        outcome=outcome,
        step_s=world.step_s,
        end_s=end_s,
        bodies=tuple(_with_unique_names(bodies)),
        signals=changes_of_signals(trace, world.step_s),
    )


def _bodies(
    trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], wheelbases_m: Mapping[str, float], roles: Sequence[str]
) -> Iterator[Body]:
    last_step = int(trace["step"].max())
    order = {role: place for place, role in enumerate(roles)}
    by_name = {str(name): rows.sort_values("step") for name, rows in trace.groupby("player", sort=True)}
    for name, rows in sorted(by_name.items(), key=lambda each: (order.get(each[0], len(order)), each[1]["step"].min())):
        drawn, kind = types[name], kind_of_shape(types[name].shape)
        wheelbase_m = wheelbases_m.get(name, WHEELBASE_SHARE * drawn.length_m)
        for piece in presences(rows):
            yield Body(
                name=name,
                original=name,
                kind=kind,
                length_m=drawn.length_m,
                width_m=drawn.width_m,
                wheelbase_m=wheelbase_m if kind.group != PERSON and drawn.shape else 0.0,
                is_player=name in order,
                first_step=int(piece["step"].iloc[0]),
                heading_rad=np.unwrap(piece["heading_rad"].to_numpy(float)),
                leaves=int(piece["step"].iloc[-1]) < last_step,
                **{column: piece[column].to_numpy(float) for column in ("time_s", "x_m", "y_m", "speed_mps")},
            )


def _buildings(outlines: Sequence[FloatArray], end_s: float) -> Iterator[Body]:
    """The smallest rectangle around each building's outline [n, 2]."""
    for number, outline in enumerate(outlines):
        rectangle = shapely.oriented_envelope(shapely.MultiPoint(outline))
        along, *across = np.diff(shapely.get_coordinates(rectangle), axis=0)  # a wall without thickness is a line
        yield Body(
            name=f"building_{number}",
            original=f"building_{number}",
            kind=BUILDING,
            length_m=float(np.hypot(*along)),
            width_m=max(float(np.hypot(*across[0])), 0.1) if across else 0.1,
            wheelbase_m=0.0,
            is_player=False,
            first_step=0,
            time_s=np.array([0.0, end_s]),
            x_m=np.full(2, rectangle.centroid.x),
            y_m=np.full(2, rectangle.centroid.y),
            heading_rad=np.full(2, np.arctan2(along[1], along[0])),
            speed_mps=np.zeros(2),
            leaves=False,
        )


def _with_unique_names(bodies: Sequence[Body]) -> Iterator[Body]:
    """Bodies with names that are no parameter of OpenSCENARIO (`$name`) and occur once."""
    taken: set[str] = set()
    for body in bodies:
        plain = _NOT_IN_NAMES.sub("_", body.name)
        name, number = plain, 2
        while name in taken:
            name, number = f"{plain}#{number}", number + 1
        taken.add(name)
        yield replace(body, name=name)
