"""Attributes of XML elements as numbers, times and lists, with the mistakes in them."""

from __future__ import annotations

import re
from math import inf, isfinite
from pathlib import Path
from xml.etree import ElementTree

from harness.errors import UsageError
from harness.traffic.xml_file import number_of

_TIME = re.compile(r"(?:(\d{1,4}):)?(\d{1,4}):(\d{1,2}):(\d{1,2}(?:\.\d{1,6})?)", re.ASCII)  # [days:]hours:minutes:s
LATEST_S = 1e7


def required(path: Path, element: ElementTree.Element, name: str) -> str:
    """The value of an attribute. Raises UsageError if it is missing or empty."""
    value = element.get(name)
    if not value:
        raise UsageError.of(path, element.tag, f"has no {name!r}", f"give every {element.tag} its {name}")
    return value


def number_in(
    path: Path, where: str, element: ElementTree.Element, name: str, above: float = -inf, most: float = inf
) -> float | None:
    """The number of an attribute, greater than `above` and up to `most`; None without the attribute.

    Raises UsageError for any other text.
    """
    value = element.get(name)
    if value is None:
        return None
    number = number_of(value)
    if not above < number <= most:
        raise UsageError.of(
            path, f"{where}.{name}", f"{value[:60]!r} is not a number that is possible here", _hint(most)
        )
    return number


def seconds_in(path: Path, where: str, element: ElementTree.Element, name: str) -> float | None:
    """The time of an attribute, in seconds or as [days:]hours:minutes:seconds; None without the attribute.

    Raises UsageError for any other text, and for a time before 0.
    """
    value = element.get(name)
    if value is None:
        return None
    clock = _TIME.fullmatch(value.strip())
    if clock is None:
        number = number_of(value)
    else:
        days, hours, minutes, seconds = (float(part or 0.0) for part in clock.groups())
        number = 86_400.0 * days + 3_600.0 * hours + 60.0 * minutes + seconds
    if not 0.0 <= number <= LATEST_S:
        message = f"{value[:60]!r} is not a number that is possible here"
        raise UsageError.of(path, f"{where}.{name}", message, f"give a time in seconds, up to {LATEST_S:g}, or h:m:s")
    return number


def _hint(most: float) -> str:
    return "give a number of seconds, metres or m/s" + (f", up to {most:g}" if isfinite(most) else "")
