"""The net of a scene: lanes, surface, levels, routes over it and right of way."""
