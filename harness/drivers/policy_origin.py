"""The games in which a policy learned, as its card (`policy.json`) says, and how other games differ from them.

Another scene, step length, friction, player or persona is worth a remark: the policy can drive there. With a car of
other actuators it can't: its actions and the angles that it observes are shares of their limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from harness.config.persona import Persona
from harness.config.scene import Scene
from harness.drivers.car import car_of
from harness.drivers.policy_file import PolicyCard, persona_hash, policy_files, read_card
from harness.errors import UsageError
from harness.game.roles import EGO, NON_EGO, ROLES
from harness.game.world import World

_UNITS = {"max_acceleration_mps2": "m/s²", "max_braking_mps2": "m/s²", "max_steering_rad": "rad"}
"""The limits of which pedals, wheel and observed angles are shares."""
_MOST_NAMED = 3


def origin_card(scene: Scene, world: World, player: int) -> dict[str, Any]:
    """The part of a card about the games of a scene in which an ego (`player` is 0) or a person learns."""
    cars, friction = _cars(world, player), list(_friction(scene))
    return {"scene": scene.name, "step_s": world.step_s, "friction": friction, "cars": cars}


def other_games(folder: Path, scene: Scene, world: World, *, player: int, persona: Persona | None = None) -> str:
    """How the games of a scene differ from those in which a policy learned, in words; empty if they don't.

    The policy drives as the ego (`player` is 0) or as a person, with the payoff of `persona` where it is given. Raises
    UsageError if its card is damaged, or if it learned with a car of other actuators.
    """
    origin = PolicyCard.from_record(read_card(folder))
    for car in _cars(world, player) if origin.cars else ():
        if car not in origin.cars:
            message = f"it learned with {_of_car(origin.cars[0])}, and the {ROLES[player]} of scene {scene.name} has "
            message += f"{_of_car(car)}: its actions and observations would have another meaning"
            remedy = "give that player the actuators it learned with, or train the policy in this scene"
            raise UsageError.of(policy_files(folder)[0], "cars", message, remedy)
    is_road = scene.name in origin.roads  # the card does not say its friction
    learned_in = scene.name if is_road else origin.scene
    pairs = {"scene": (learned_in, scene.name), "player": (origin.player, ROLES[player])}
    if origin.step_s is not None:
        pairs["step_s"] = (f"{origin.step_s:g}", f"{world.step_s:g}")
    low, high = _friction(scene)
    if origin.friction is not None and not is_road and not origin.friction[0] <= low <= high <= origin.friction[1]:
        pairs["friction"] = (_range(origin.friction), _range((low, high)))
    if persona is not None and origin.persona_sha256 not in (None, persona_hash(persona)):
        of_same_name = " with another payoff or other limits" if origin.persona == persona.name else ""
        pairs["persona"] = (origin.persona, persona.name + of_same_name)
    found = [f"{key} {there}, here {here}" for key, (there, here) in pairs.items() if there not in (None, here)]
    return f"learned in other games: {'; '.join(found)}" if found else ""


def grouped(remarks: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Remarks by name, with the names of the same remark in one text: of many the first."""
    names: dict[str, list[str]] = {}
    for name, remark in remarks.items():
        names.setdefault(remark, []).append(name)
    for remark, same in names.items():
        more = [f"{len(same) - _MOST_NAMED} more"] if len(same) > _MOST_NAMED else []
        yield ", ".join([*same[:_MOST_NAMED], *more]), remark


def _cars(world: World, player: int) -> list[dict[str, float]]:
    """The limits of an ego's car, or of each different one of the persons."""
    players = (EGO,) if player == EGO else range(NON_EGO, len(world.roles))
    cars = [{name: car_of(world, each).limits[name] for name in _UNITS} for each in players]
    return [car for place, car in enumerate(cars) if car not in cars[:place]]


def _of_car(car: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {car[name]:g} {unit}" for name, unit in _UNITS.items() if name in car)


def _friction(scene: Scene) -> tuple[float, float]:
    return scene.varies.friction or (scene.friction, scene.friction)


def _range(friction: tuple[float, float]) -> str:
    low, high = friction
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
