"""SUMO's XML files and programs."""
