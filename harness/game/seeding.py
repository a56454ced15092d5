"""Seeds hashed from named parts: random numbers do not depend on the order of draws or on other draws."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np


def seed_of(*parts: str | int) -> int:
    """A 63-bit seed hashed from named parts, such as ("assessment", 1, "episode", 7)."""
    text = "\x1f".join([f"{'str' if isinstance(part, str) else 'int'}:{part}" for part in parts])  # NumPy ints too
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def generator_of(*parts: str | int) -> np.random.Generator:
    """A random generator seeded from named parts."""
    return np.random.Generator(np.random.PCG64(seed_of(*parts)))


def parts_of(seed: int, episode: int) -> tuple[str | int, ...]:
    """The parts that name the random numbers of an episode; `seed` is that of the starts, the same in every arm."""
    return ("assessment", seed, "episode", episode)


def drawn_index(shares: Sequence[float], generator: np.random.Generator) -> int:
    """Draw an index by shares, whose sum need not be 1."""
    upper = np.cumsum(shares)
    return int(np.searchsorted(upper, generator.random() * upper[-1], side="right"))


def between(bounds: tuple[float, float], share: float) -> float:
    """The point at a share, from 0 to 1, of the way between two bounds.

    For a drawn share the result equals NumPy's `uniform`, which takes three times as long.
    """
    low, high = bounds
    return low + (high - low) * share
