"""The bodies of a game: its players, and the background vehicles near them."""

from __future__ import annotations

from harness.game.arrays import FloatArray, IntArray
from harness.game.neighbours import NOTICED_M
from harness.game.state import Bodies, State
from harness.traffic.simulation import Reading

NEAREST = 16  # background vehicles in a game's bodies


def nearby_bodies(
    state: State, reading: Reading | None, games: IntArray | slice, *, length_m: FloatArray, width_m: FloatArray
) -> Bodies:
    """The players [N, P], then up to `NEAREST` background vehicles nearest to them.

    `state`, and the players' `length_m` and `width_m` [N, P], are those of `games`; `reading` is that of all games.
    """
    players = Bodies(
        x_m=state.x_m,
        y_m=state.y_m,
        heading_rad=state.heading_rad,
        speed_mps=state.speed_mps,
        length_m=length_m,
        width_m=width_m,
        present=state.present.copy(),
    )
    if reading is None or not reading.present.size:
        return players
    background = Bodies(
        x_m=reading.x_m[games],
        y_m=reading.y_m[games],
        heading_rad=reading.heading_rad[games],
        speed_mps=reading.speed_mps[games],
        length_m=reading.length_m[games],
        width_m=reading.width_m[games],
        present=reading.present[games],
    )
    return players.with_nearest(background, NEAREST, NOTICED_M)
