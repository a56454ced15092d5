"""Recorded games as files of other programs: OpenSCENARIO with OpenDRIVE, and tables in the layout of highD."""
