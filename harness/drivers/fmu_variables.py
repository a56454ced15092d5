"""Types of an FMU's variables: which values they take, and how an entry of the observation becomes one."""

from __future__ import annotations

from typing import Any, TypeAlias

REALS = ("Real", "Float64", "Float32")
INTEGERS = ("Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))
ENTRY_TYPES = (*REALS, *INTEGERS, "Boolean", "Enumeration")
"""Types that an entry of the observation can be connected to: it is rounded for an integer or an enumeration, and a
Boolean is true from 0.5 on."""

Value: TypeAlias = "bool | int | float | str"


def setter_of(fmi: str, variable_type: str) -> str:
    """The name of FMPy's function that sets variables of a type."""
    if variable_type == "Enumeration":
        return "setInteger" if fmi.startswith("2.") else "setInt64"
    return f"set{variable_type}"


def entry_as(variable_type: str, entry: float) -> bool | int | float:
    """An entry of the observation as a value of a variable."""
    if variable_type == "Boolean":
        return entry >= 0.5
    return entry if variable_type in REALS else round(entry)


def value_for(variable: Any, written: Value) -> Value:
    """The value of a document for a variable. Raises ValueError, with what is expected, if it is of another type."""
    kind = variable.type
    if kind == "Enumeration":
        return _item(variable, written)
    if kind == "Boolean" and isinstance(written, bool):
        return written
    if kind == "String" and isinstance(written, str):
        return written
    number = isinstance(written, int | float) and not isinstance(written, bool)
    if kind in REALS and number:
        return float(written)
    if kind in INTEGERS and number and float(written).is_integer():
        return int(written)
    expected = {"Boolean": "true or false", "String": "a text"}.get(kind)
    expected = expected or ("a number" if kind in REALS else "an integer" if kind in INTEGERS else "no value")
    raise ValueError(f"takes {expected}, because it is of type {kind}")


def _item(variable: Any, written: Value) -> int:
    """An item of an enumeration, which is written as its name or its number."""
    items = {each.name: int(each.value) for each in getattr(variable.declaredType, "items", None) or ()}
    if isinstance(written, str) and written in items:
        return items[written]
    if isinstance(written, int) and not isinstance(written, bool) and (written in items.values() or not items):
        return written
    names = ", ".join(f"{name!r} ({value})" for name, value in list(items.items())[:10])
    raise ValueError(f"takes one of {names}" if names else "takes an integer, because it is an enumeration")
