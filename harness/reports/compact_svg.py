"""An SVG drawing in fewer characters: what matplotlib writes, with the same shapes at the same places.

Groups and ids that nothing refers to are left out, equal styles become one class, and paths have relative coordinates.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

_TOKEN = re.compile(r"<!--.*?-->|<[^>]*>|[^<]+", re.DOTALL)
_ATTRIBUTE = re.compile(r'\s([\w:-]+)="([^"]*)"')
_ID = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'href="#([^"]+)"|url\(#([^)]+)\)')
_COMMAND = re.compile(r"([A-Za-z])([^A-Za-z]*)")
_LAST_NUMBER = re.compile(r"[\d.]*$")
_NO_TURN = re.compile(r"rotate\(-?0(?:\.0*)?[ ,][^)]*\)")
_DECIMALS, _DECIMALS_OF_MANY, _MANY = 2, 1, 20
"""Of a coordinate (1/72 inch), and of one of a path of more than so many points."""
_Token: TypeAlias = tuple[str, dict[str, str], str]
"""The name of a tag, its attributes and its end; or nothing, nothing and a text or the end of an element."""
_COUNTS = {"M": 2, "L": 2, "C": 6, "Q": 4, "Z": 0}
"""The commands of a path that matplotlib writes, with how many numbers follow each."""


def compact(drawing: str, name: str) -> str:
    """What is inside an SVG element, in fewer characters. `name` is the class of the element and begins its ids."""
    there = {*_ID.findall(drawing)}
    used = dict.fromkeys(one or other for one, other in _REFERENCE.findall(drawing))
    ids = {found: f"{name}-{place}" for place, found in enumerate(each for each in used if each in there)}
    tokens = _joined_groups(_kept(drawing, ids))
    counts = Counter(attributes["style"] for _, attributes, _ in tokens if "style" in attributes)
    shared = [style for style, count in counts.items() if count > 1]
    classes = {style: _letters(place) for place, style in enumerate(shared)}
    rules = "".join(f".{name} .{each}{{{_with_ids(style, ids)}}}" for style, each in classes.items())
    texts = [_written(tag, attributes, end, ids, classes) for tag, attributes, end in tokens]
    return (f"<style>{rules}</style>" if rules else "") + "".join(texts)


def _kept(drawing: str, ids: Mapping[str, str]) -> Iterator[_Token]:
    """What draws something."""
    open_tags: list[tuple[str, bool]] = []
    for token in _TOKEN.findall(drawing):
        if token.startswith("<!--"):
            continue
        if not token.startswith("<"):
            if token.strip() or (open_tags and open_tags[-1][0] in ("text", "tspan", "title")):
                yield "", {}, token
        elif token.startswith("</"):
            if open_tags:
                tag, is_kept = open_tags.pop()
                if not is_kept:
                    continue
            yield "", {}, token
        else:
            tag = token[1:].split(None, 1)[0].rstrip("/>")
            attributes = _attributes(tag, token, ids)
            is_alone = token.endswith("/>")
            is_kept = tag != "g" or bool(attributes) or is_alone
            if not is_alone:
                open_tags.append((tag, is_kept))
            if is_kept:
                yield tag, attributes, "/>" if is_alone else ">"


def _joined_groups(tokens: Iterable[_Token]) -> list[_Token]:
    """The tokens with one group in the place of two with the same attributes, one after the other."""
    found: list[_Token] = []
    open_tags: list[dict[str, str]] = []
    closed: dict[str, str] | None = None  # of the group that the last token has ended
    for tag, attributes, end in tokens:
        if tag == "g" and end == ">" and attributes == closed and "id" not in attributes:
            found.pop()
            open_tags.append(attributes)
            closed = None
            continue
        closed = None
        if tag and end == ">":
            open_tags.append(attributes)
        elif not tag and end.startswith("</") and open_tags:
            attributes = open_tags.pop()
            closed = attributes if end == "</g>" else None
            attributes = {}
        found.append((tag, attributes, end))
    return found


def _attributes(tag: str, token: str, ids: Mapping[str, str]) -> dict[str, str]:
    """The attributes of a tag that say something."""
    found = dict(_ATTRIBUTE.findall(token))
    if found.get("id", "") not in ids:
        found.pop("id", None)
    if "clip-path" in found and tag != "g":
        found["style"] = ";".join(filter(None, (found.get("style", ""), f"clip-path:{found.pop('clip-path')}")))
    if "style" in found:
        found["style"] = ";".join(re.sub(r"\s*:\s*", ":", part.strip()) for part in found["style"].split(";"))
    if _NO_TURN.fullmatch(found.get("transform", "")):
        del found["transform"]
    if "d" in found:
        found["d"] = compact_path(found["d"])
    return found


def _written(
    tag: str, attributes: Mapping[str, str], end: str, ids: Mapping[str, str], classes: Mapping[str, str]
) -> str:
    if not tag:
        return end
    said = dict(attributes)
    if "id" in said:
        said["id"] = ids[said["id"]]
    if said.get("style") in classes:
        said = {"class": classes[said.pop("style")], **said}
    text = "".join(f' {key}="{value}"' for key, value in said.items())
    return f"<{tag}{_with_ids(text, ids)}{end}"


def _with_ids(text: str, ids: Mapping[str, str]) -> str:
    """A text with the new ids in its references."""

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
