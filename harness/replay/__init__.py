"""A recorded game as a folder that SUMO-GUI opens as it is, and which games are worth one."""

from harness.replay.choice import choose_games, replay_name, worst_first
from harness.replay.desktop import follow_in_sumo_gui, open_in_sumo_gui
from harness.replay.film import write_film
from harness.replay.folder import write_replay

__all__ = [
    "choose_games",
    "follow_in_sumo_gui",
    "open_in_sumo_gui",
    "replay_name",
    "worst_first",
    "write_film",
    "write_replay",
]
