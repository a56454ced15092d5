"""Where the repository is."""

from __future__ import annotations

from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
"""The top level: `harness/`, `networks/`, `personas/` and `campaigns/` are in it."""
