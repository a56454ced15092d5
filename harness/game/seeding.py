"""Seeds hashed from named parts, so that nothing's numbers depend on what else there is or on any order."""

from __future__ import annotations

import hashlib

import numpy as np


def seed_of(*parts: str | int) -> int:
    """A 63-bit seed hashed from named parts, such as ("assessment", 1, "episode", 7)."""
    text = "\x1f".join(f"{'str' if isinstance(part, str) else 'int'}:{part}" for part in parts)  # NumPy's ints too
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def generator_of(*parts: str | int) -> np.random.Generator:
    """A random generator seeded from named parts."""
    return np.random.Generator(np.random.PCG64(seed_of(*parts)))


def between(bounds: tuple[float, float], share: float) -> float:
    """What lies at a share of the way, from 0 to 1, between two bounds. Of a share that is drawn, NumPy's `uniform`
    makes the same, at three times the price."""
    low, high = bounds
    return low + (high - low) * share
