"""Words that agree with a number."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """A number and its noun, with an "s" unless the number is 1."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
