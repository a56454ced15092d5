"""An SVG drawing in fewer characters: what matplotlib writes, with the same shapes at the same places.

Groups and ids that nothing refers to are left out, equal styles become one class, and paths have relative coordinates.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from xml.etree import ElementTree
from xml.sax.saxutils import escape

_ID = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'href="#([^"]+)"|url\(#([^)]+)\)')
_COMMAND = re.compile(r"([A-Za-z])([^A-Za-z]*)")
_LAST_NUMBER = re.compile(r"[\d.]*$")
_NO_TURN = re.compile(r"rotate\(-?0(?:\.0*)?[ ,][^)]*\)")
_DECIMALS, _DECIMALS_OF_MANY, _MANY = 2, 1, 20
"""Of a coordinate (1/72 inch), and of one of a path of more than so many points."""
_WITH_TEXT = ("text", "tspan", "title")
_COUNTS = {"M": 2, "L": 2, "C": 6, "Q": 4, "Z": 0}
"""The commands of a path that matplotlib writes, with how many numbers follow each."""


def compact(drawing: str, name: str) -> str:
    """What is inside an SVG element, and its end, in fewer characters. `name` is the class of the element and begins
    its ids."""
    there = {*_ID.findall(drawing)}
    used = dict.fromkeys(one or other for one, other in _REFERENCE.findall(drawing))
    ids = {found: f"{name}-{place}" for place, found in enumerate(each for each in used if each in there)}
    root = ElementTree.fromstring(f"<svg>{drawing}")
    _simplify(root, ids)
    counts = Counter(each.attrib["style"] for each in root.iter() if "style" in each.attrib)
    shared = [style for style, count in counts.items() if count > 1]
    classes = {style: _letters(place) for place, style in enumerate(shared)}
    rules = "".join(f".{name} .{each}{{{_with_ids(style, ids)}}}" for style, each in classes.items())
    return (f"<style>{rules}</style>" if rules else "") + "".join(_inside(root, ids, classes)) + "</svg>"


def _simplify(element: ElementTree.Element, ids: Mapping[str, str]) -> None:
    """Leave out what draws nothing in an element: groups that say nothing, and those that repeat the one before."""
    found: list[ElementTree.Element] = []
    for child in element:
        _simplify_attributes(child, ids)
        _simplify(child, ids)
        for each in child if _is_group(child) and not child.attrib else [child]:
            before = found[-1] if found and _is_group(found[-1]) else None
            if before is not None and _is_group(each) and each.attrib == before.attrib and "id" not in each.attrib:
                before.extend(each)
            else:
                found.append(each)
    element[:] = found


def _is_group(element: ElementTree.Element) -> bool:
    return element.tag == "g" and not _is_alone(element)


def _is_alone(element: ElementTree.Element) -> bool:
    """Whether nothing is inside an element, not even blanks."""
    return not len(element) and element.text is None


def _simplify_attributes(element: ElementTree.Element, ids: Mapping[str, str]) -> None:
    """Leave out the attributes that say nothing, and write the others briefly."""
    found = element.attrib
    if found.get("id", "") not in ids:
        found.pop("id", None)
    if "clip-path" in found and element.tag != "g":
        found["style"] = ";".join(filter(None, (found.get("style", ""), f"clip-path:{found.pop('clip-path')}")))
    if "style" in found:
        found["style"] = ";".join(re.sub(r"\s*:\s*", ":", part.strip()) for part in found["style"].split(";"))
    if _NO_TURN.fullmatch(found.get("transform", "")):
        del found["transform"]
    if "d" in found:
        found["d"] = compact_path(found["d"])


def _inside(element: ElementTree.Element, ids: Mapping[str, str], classes: Mapping[str, str]) -> Iterator[str]:
    """What is inside an element, as text."""
    has_text = element.tag in _WITH_TEXT
    yield escape(element.text or "") if has_text else ""
    for child in element:
        said = dict(child.attrib)
        if "id" in said:
            said["id"] = ids[said["id"]]
        if said.get("style") in classes:
            said = {"class": classes[said.pop("style")], **said}
        text = "".join(f' {key}="{escape(value)}"' for key, value in said.items())
        yield f"<{child.tag}{_with_ids(text, ids)}"
        yield from ["/>"] if _is_alone(child) else [">", *_inside(child, ids, classes), f"</{child.tag}>"]
        yield escape(child.tail or "") if has_text else ""


def _with_ids(text: str, ids: Mapping[str, str]) -> str:
    def renamed(reference: re.Match[str]) -> str:
        own = reference[1] or reference[2]
        return reference[0].replace(own, ids.get(own, own))

    return _REFERENCE.sub(renamed, text)


def _letters(place: int) -> str:
    """a, b, ..., z, aa, ab, ..."""
    more, rest = divmod(place, 26)
    return (_letters(more - 1) if more else "") + chr(ord("a") + rest)


def compact_path(path: str) -> str:
    """A path of absolute commands with relative ones. Each point is where it was, rounded: errors do not add up. A path
    with other commands is unchanged."""
    commands = [(command.upper(), text.split()) for command, text in _COMMAND.findall(path)]
    if not all(len(numbers) == _COUNTS.get(command) for command, numbers in commands) or path[:1] != "M":
        return path
    decimals = _DECIMALS_OF_MANY if len(commands) > _MANY else _DECIMALS
    written, before = "", ""
    at = start = (0, 0)
    for command, texts in commands:
        if command == "Z":
            written, before, at = f"{written}z", "z", start
            continue
        numbers = [round(float(each) * 10**decimals) for each in texts]
        steps = [number - at[index % 2] for index, number in enumerate(numbers)]
        at = (numbers[-2], numbers[-1])
        start = at if command == "M" else start
        kind = command.lower()
        if kind == "l" and 0 in steps:
            kind, steps = ("h", steps[:1]) if steps[1] == 0 else ("v", steps[1:])
        if kind == "m" or kind != {"m": "l"}.get(before, before):  # numbers after a move are lines
            written += kind
        written, before = _followed(written, steps, decimals), kind
    return written


def _followed(text: str, numbers: Sequence[int], decimals: int) -> str:
    """A text, and whole numbers of the last decimal behind it, with as few separators as can be read back."""
    for each in numbers:
        written = _decimal(each, decimals)
        is_second_point = written[0] == "." and "." in _LAST_NUMBER.search(text, max(len(text) - 20, 0))[0]  # type: ignore[index]
        is_parted = written[0] == "-" or text[-1:].isalpha() or is_second_point
        text += written if is_parted else f" {written}"
    return text


def _decimal(number: int, decimals: int) -> str:
    """A whole number of the last decimal as a decimal number without zeros that say nothing."""
    whole, rest = divmod(abs(number), 10**decimals)
    text = f"{whole or ''}" + (f".{rest:0{decimals}d}".rstrip("0") if rest else "") or "0"
    return f"-{text}" if number < 0 else text
