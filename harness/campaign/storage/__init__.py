"""The run folder: what is stored, under which checksums and locks."""
