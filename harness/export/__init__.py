"""Recorded games as files of other programs: OpenSCENARIO with OpenDRIVE, and tables in the layout of highD."""

from harness.export.exported_game import ExportedGame, exported_game
from harness.export.folder import Formats, check_folder, check_formats, write_games

__all__ = ["ExportedGame", "Formats", "check_folder", "check_formats", "exported_game", "write_games"]
