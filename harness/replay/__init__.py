"""A recorded game as a folder that SUMO-GUI opens, or as a film."""

from harness.replay.bundle import write_replay
from harness.replay.film import write_film
from harness.replay.sumo_gui import follow_in_sumo_gui
from harness.replay.vehicles import legend, names_in_pictures

__all__ = ["follow_in_sumo_gui", "legend", "names_in_pictures", "write_film", "write_replay"]
