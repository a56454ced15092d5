"""An obstacle of a scene: what it is, how large it is, where it stands, and whether it hides what is behind it."""

from __future__ import annotations

from math import radians
from typing import Annotated, Any, Literal, TypeAlias, get_args

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from harness.config.toml_reading import Document, ordered

Kind: TypeAlias = Literal[
    "car", "van", "truck", "bus", "broken_down_car", "cone", "debris", "wall", "closed_lane", "building"
]
VEHICLES = ("car", "van", "truck", "bus", "broken_down_car")
"""Kinds of obstacles that are vehicles."""
USUAL_SIZE_M = {
    "car": (5.0, 1.8),
    "broken_down_car": (5.0, 1.8),
    "van": (6.5, 2.16),
    "truck": (7.1, 2.4),
    "bus": (12.0, 2.5),
    "cone": (0.4, 0.4),
    "debris": (1.0, 0.5),
}
"""Length and width by kind: of vehicles, SUMO's for its classes (passenger, delivery, truck, bus)."""


def _as_range(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value, value
    return tuple(value) if isinstance(value, list) else value


_Place = Annotated[float, Field(ge=-1e7, le=1e7)]
Corner = tuple[_Place, _Place]
NumberOrRange = Annotated[
    Corner, AfterValidator(ordered), BeforeValidator(_as_range, json_schema_input_type=float | tuple[float, float])
]
"""A number, or a range from which each game draws by its seed; read as a range."""


class Obstacle(Document):
    """A body that stands in one place for a whole game. Cars that touch it have collided."""

    kind: Kind
    """What it is. A `closed_lane` is as wide as its lane; a `building` has an `outline` and stands off the road. Vans,
    trucks, buses, walls and buildings hide what is behind them."""
    lane: str | None = None
    """The lane it stands on or beside, with `position_m`."""
    position_m: NumberOrRange | None = None
    """Of its centre, along the lane: a number, or a range."""
    offset_m: NumberOrRange = (0.0, 0.0)
    """Of its centre from the middle of the lane, to the left: a number, or a range."""
    turned_deg: NumberOrRange = (0.0, 0.0)
    """Of its direction from that of the lane, counter-clockwise: a number, or a range."""
    x_m: NumberOrRange | None = None
    """Instead of a lane: of its centre in the net's coordinates, a number or a range."""
    y_m: NumberOrRange | None = None
    """As `x_m`."""
    heading_deg: NumberOrRange | None = None
    """With `x_m` and `y_m`: its direction, 0 is east, 90 is north; a number, or a range."""
    length_m: float | None = Field(None, ge=0.1, le=200.0)
    """Its length; left out: that of its kind."""
    width_m: float | None = Field(None, ge=0.1, le=200.0)
    """Its width; left out: that of its kind."""
    outline: list[Corner] | None = Field(None, min_length=2, max_length=100)
    """Of a building: its corners [x, y] in the net's coordinates, in order. Two corners are a wall."""

    @model_validator(mode="after")
    def _has_a_place_and_a_size(self) -> Obstacle:
        given = {name for name in self.model_fields_set - {"kind"} if getattr(self, name) is not None}
        if self.kind == "building":
            if "outline" not in given:
                raise ValueError("a building needs its outline; a wall on the road is a wall")
            if surplus := sorted(given - {"outline"}):
                raise ValueError(f"a building is where its outline is: leave out {surplus[0]}")
            return self
        if "outline" in given:
            raise ValueError(f"only a building has an outline; give a {self.kind} a lane or x_m, y_m and heading_deg")
        on_lane, at_point, relative = {"lane", "position_m"}, {"x_m", "y_m", "heading_deg"}, {"offset_m", "turned_deg"}
        if bool(given & on_lane) == bool(given & at_point):
            raise ValueError("give either lane and position_m, or x_m, y_m and heading_deg")
        if not (on_lane <= given or at_point <= given):
            missing = "lane and position_m" if given & on_lane else "x_m, y_m and heading_deg"
            raise ValueError(f"has a part of its place: give {missing}")
        if given & at_point and given & relative:
            raise ValueError("offset_m and turned_deg are relative to a lane: leave them out, or give lane")
        if self.kind == "closed_lane" and (given & (relative | {"width_m"}) or self.lane is None):
            raise ValueError("a closed_lane fills its lane: give lane, and leave out width_m, offset_m and turned_deg")
        for name in {"closed_lane": ("length_m",), "wall": ("length_m", "width_m")}.get(self.kind, ()):
            if name not in given:
                raise ValueError(f"a {self.kind} needs its {name}")
        return self

    @property
    def is_hiding(self) -> bool:
        """Whether it is higher than eyes, and hides what is behind it."""
        return self.kind in ("van", "truck", "bus", "wall", "building")

    @property
    def turned_rad(self) -> tuple[float, float]:
        return radians(self.turned_deg[0]), radians(self.turned_deg[1])


assert {*USUAL_SIZE_M, "wall", "closed_lane", "building"} == set(get_args(Kind)), "every kind has a size or needs one"
