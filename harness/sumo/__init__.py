"""SUMO simulations of opened scenes, and SUMO-GUI. The only room that imports libsumo."""
