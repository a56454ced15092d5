"""What the harness costs, as ratios measured side by side: `python -m benchmarks`, or `make bench`."""
