"""Measurements of the cost of the harness: `python -m benchmarks`, or `make bench`."""
