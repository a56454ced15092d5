"""Reading SUMO's XML files, and the numbers in them: UTF-8, no entities, document types and schemas but SUMO's.

A file whose name ends with `.gz` is compressed with gzip.
"""

from __future__ import annotations

import errno
import gzip
import io
import math
import re
import zlib
from collections.abc import Callable
from math import inf
from pathlib import Path
from xml.etree import ElementTree

from defusedxml import ElementTree as SafeElementTree
from defusedxml.common import DefusedXmlException

from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.files import content_of

MOST_BYTES = 200_000_000
"""Of a file of SUMO, unpacked."""
_REMEDY = "open it in netedit and save it again"
_ENCODING = re.compile(r"""^<\?xml[^>]*?encoding\s*=\s*["']([^"']*)["']""")
_SCHEMA = re.compile(r"https?://((www\.)?sumo-sim\.org|sumo\.dlr\.de|sumo\.(sf|sourceforge)\.net)/xsd/\w+\.xsd")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_XSI = "{http://www.w3.org/2001/XMLSchema-instance}"


def parse_xml(path: Path, is_kept: Callable[[ElementTree.Element], bool] | None = None) -> ElementTree.Element:
    """The root of an XML file, if given only with those of its children that are kept.

    Raises UsageError if the file is missing, malformed or has entities.
    """
    try:
        content = xml_bytes(path)
    except FileNotFoundError:
        siblings = [each.name for each in path.parent.glob("*.xml*")] or ["(no XML file in the folder)"]
        raise UsageError.of(path, "", "there is no such file", nearest(path.name, siblings)) from None
    except OSError as error:
        remedy = "name a plain file, or cut out the part that the scene needs"
        raise UsageError.of(path, "", f"is not readable XML: {error.strerror}", remedy) from None
    try:
        _check_encoding(content)
        parser = SafeElementTree.XMLParser(
            forbid_dtd=True, target=_Builder(is_kept) if is_kept else ElementTree.TreeBuilder()
        )
        parser.feed(content)
        root: ElementTree.Element = parser.close()
    except DefusedXmlException as error:
        message = f"carries XML entities or a document type: {error}"
        raise UsageError.of(path, "", message, "remove them") from None
    except UnicodeDecodeError as error:
        raise UsageError.of(path, "", f"is not readable XML: not UTF-8: {error}", "save it as UTF-8") from None
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        raise UsageError.of(path, "", f"is not readable XML: {error}", _REMEDY) from None
    _check_schema_names(path, root)
    return root


def _check_encoding(content: bytes) -> None:
    """Raise ValueError unless a text is UTF-8: SUMO's parser and this one might read others differently."""
    declared = _ENCODING.match(content.decode("utf-8-sig"))
    if declared and declared[1].lower() not in ("utf-8", "us-ascii"):
        raise ValueError(f"its declared encoding is {declared[1]}")


class _Builder(ElementTree.TreeBuilder):
    """Builds a tree without the children of the root that are not kept, which takes less memory."""

    def __init__(self, is_kept: Callable[[ElementTree.Element], bool]) -> None:
        super().__init__()
        self._is_kept, self._open = is_kept, list[ElementTree.Element]()

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementTree.Element:
        self._open.append(super().start(tag, attrs))
        return self._open[-1]

    def end(self, tag: str, /) -> ElementTree.Element:
        element = super().end(tag)
        self._open.pop()
        if len(self._open) == 1 and not self._is_kept(element):
            del self._open[0][-1]
        return element


def xml_bytes(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """The content of a file, unpacked if its name ends with `.gz`.

    Raises OSError for anything but a plain file of limited size, UsageError for one that is not valid gzip.
    """
    content = content_of(path, most_bytes)
    if path.suffix.lower() != ".gz":
        return content
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            content = file.read(most_bytes + 1)
    except EOFError:
        raise UsageError.of(path, "", "is cut off: its gzip data has no end", "compress it again") from None
    except (gzip.BadGzipFile, zlib.error) as error:
        raise UsageError.of(path, "", f"is not a gzip file: {error}", "compress it again, or remove .gz") from None
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f"holds more than {most_bytes / 1e6:,.0f} MB", str(path))
    return content


def _check_schema_names(path: Path, root: ElementTree.Element) -> None:
    """Raise UsageError for schemas other than SUMO's: a validating parser would read the files that they name."""
    for element in root.iter():
        for name, value in element.attrib.items():
            is_sumos = name == f"{_XSI}noNamespaceSchemaLocation" and element is root and _SCHEMA.fullmatch(value)
            if name.startswith(_XSI) and not is_sumos:
                key = f"{element.tag}.{name.removeprefix(_XSI)}"
                raise UsageError.of(path, key, f"names the schema {value!r}", "leave it out, or name SUMO's own")


def number_of(text: str) -> float:
    """The number that SUMO reads from a text; NaN if the text is not a finite number."""
    number = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
    return number if math.isfinite(number) else math.nan


_TIME = re.compile(r"(?:(\d{1,4}):)?(\d{1,4}):(\d{1,2}):(\d{1,2}(?:\.\d{1,6})?)", re.ASCII)  # [days:]hours:minutes:s
LATEST_S = 1e7


def required(path: Path, element: ElementTree.Element, name: str) -> str:
    """The value of an attribute. Raises UsageError if it is missing or empty."""
    value = element.get(name)
    if not value:
        raise UsageError.of(path, element.tag, f"has no {name!r}", f"give every {element.tag} its {name}")
    return value


def number_in(
    path: Path, where: str, element: ElementTree.Element, name: str, *, above: float = -inf, most: float = inf
) -> float | None:
    """The number of an attribute, greater than `above` and up to `most`; None without the attribute.

    Raises UsageError for any other text.
    """
    value = element.get(name)
    if value is None:
        return None
    number = number_of(value)
    if not above < number <= most:
        message = f"{value[:60]!r} is not a number that is possible here"
        least = " above 0" if above == 0.0 else f" of at least {max(above, 0.0):.2g}" if above > -inf else ""
        hint = f"give a number{least}" + (f", up to {most:g}" if most < inf else "")
        raise UsageError.of(path, f"{where}.{name}", message, hint)
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
