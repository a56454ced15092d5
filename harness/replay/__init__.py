"""A recorded game as a folder that SUMO-GUI opens, or as a film; and the choice of games to record."""

from harness.replay.bundle import write_replay
from harness.replay.film import write_film
from harness.replay.selection import choose_games, replay_name
from harness.replay.sumo_gui import follow_in_sumo_gui
from harness.replay.vehicles import names_in_pictures

__all__ = ["choose_games", "follow_in_sumo_gui", "names_in_pictures", "replay_name", "write_film", "write_replay"]
