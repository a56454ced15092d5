"""SUMO, and the only place that imports it."""
