"""Numbers as text: rates, p-values, intervals, durations. "–" stands for a number that can't be measured."""

from __future__ import annotations

import math

NO_SPACE = "\N{NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"
MISSING = "–"
SURE = f"95{NO_SPACE}%"
"""The confidence of every interval on the page."""

ROUNDING = 1e-9
"""A number that is nearer to 0 is an error of rounding."""


def number(value: float, digits: int) -> str:
    """A number with `digits` decimals and a typographic minus."""
    if not math.isfinite(value):
        return MISSING
    text = f"{value:,.{digits}f}"
    if not text.strip("-0.,"):  # no negative zero
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def trimmed(value: float, digits: int) -> str:
    """The same without zeros at the end of a fraction."""
    text = number(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text


def signed(value: float, digits: int) -> str:
    """The same, with the sign of a number that rounds to 0: an end of an interval just below 0 is not 0. An error of
    rounding is 0."""
    text = trimmed(value, digits)
    return f"{MINUS}{-value:.1g}" if value < -ROUNDING and text == "0" else text


def short(value: float) -> str:
    """A number with four significant digits."""
    return f"{value:.4g}".replace("-", MINUS) if math.isfinite(value) else MISSING


def percent(share: float) -> str:
    """A share as per cent, with a decimal where it has one."""
    return f"{trimmed(share * 100, 1)}{NO_SPACE}%" if math.isfinite(share) else MISSING


def interval(low: float, high: float) -> str:
    """Two shares as per cent, e.g. "16.9–34.7 %"."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return MISSING
    return f"{trimmed(low * 100, 1)}–{trimmed(high * 100, 1)}{NO_SPACE}%"


def sure(low: float, high: float) -> str:
    """The 95 % interval of a share, e.g. "95 %: 16.9–34.7 %"."""
    return f"{SURE}: {interval(low, high)}"


def p_text(p: float) -> str:
    """A p-value with its sign, e.g. "p = 0.02"; never rounded to 0 or 1."""
    if not math.isfinite(p):
        return "no p-value"
    return f"p{NO_SPACE}{p_number(p) if p_number(p)[0] in '<>' else f'={NO_SPACE}{p_number(p)}'}"


def p_number(p: float) -> str:
    """A p-value to three digits; "< 0.0001" and "> 0.999" at the ends."""
    if not math.isfinite(p):
        return MISSING
    if p < 0.0001:
        return f"<{NO_SPACE}0.0001"
    if 0.999 < p < 1:
        return f">{NO_SPACE}0.999"
    return f"{p:.4f}".rstrip("0") if p < 0.001 else f"{p:.3g}"


def steps_text(steps: float) -> str:
    """A number of steps, e.g. "150 k" or "1.2 M"."""
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if abs(steps) >= 0.9995 * size:  # it has three digits, and rounds to one of the size
            return f"{steps / size:.3g} {letter}"
    return f"{steps:.3g}"


def duration(seconds: float | None) -> str:
    """E.g. "1 h 02 min", "3 min 05 s" or "12.3 s"; "–" when not known."""
    if seconds is None:
        return MISSING
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
