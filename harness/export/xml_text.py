"""XML documents as bytes."""

from __future__ import annotations

import re
from xml.etree import ElementTree

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def xml_text(root: ElementTree.Element) -> bytes:
    """A document, indented; the same content gives the same bytes. Characters that XML can't contain become `?`."""
    for element in root.iter():
        for name, value in element.attrib.items():
            element.set(name, _NOT_XML.sub("?", value))
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"
