"""The SUMO simulation and its files. Only this package imports SUMO."""
