"""The road of a scene: SUMO's files, its net, its traffic and its players, checked and opened."""
