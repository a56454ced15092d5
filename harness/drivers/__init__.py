"""Drivers: what decides a player's actions, behind one protocol for the ego and the non-ego."""
