"""Signals' states in words of other standards."""

from __future__ import annotations

from harness.export.exported_game import ExportedGame

AFTER_THE_GAME_S = 3600.0
"""Duration of the last phase: phases start again when they have ended."""
_LAMPS = {
    "r": "on;off;off",
    "u": "on;on;off",
    "y": "off;on;off",
    "Y": "off;on;off",
    "g": "off;off;on",
    "G": "off;off;on",
    "s": "on;off;off",
    "o": "off;flashing;off",
    "O": "off;off;off",
}


def lamps(state: str) -> str:
    """The modes of a signal's red, yellow and green lamps, by a link's state in SUMO."""
    return _LAMPS.get(state, "off;off;off")


def signal_phases(game: ExportedGame) -> dict[str, list[tuple[float, str]]]:
    """Durations (s) and states of the phases of each light; the last phase lasts beyond the game."""
    changes: dict[str, list[tuple[float, str]]] = {}
    for change in game.signals:
        changes.setdefault(change.light, []).append((change.time_s, change.state))
    return {
        light: [
            (of_light[place + 1][0] - time_s if place + 1 < len(of_light) else AFTER_THE_GAME_S, state)
            for place, (time_s, state) in enumerate(of_light)
        ]
        for light, of_light in changes.items()
    }
