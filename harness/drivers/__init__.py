"""Who decides what a player does: one protocol for the ego and the non-ego alike."""
