"""Maps of users: SUMO nets, OpenStreetMap and OpenDRIVE files, the conflicts on them, and games that meet there."""
