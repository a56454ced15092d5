"""JUnit XML files: their counts, messages and safety, read back by the standard library."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from harness.reports.junit import case_of, write_junit

CHECKS = [
    case_of("failure rate", "merge.speedy", seconds=1.5, details="at most 0.2\nfound 0.1"),
    case_of("near misses", "merge.speedy", failure="12 of 100, more than 5"),
    case_of("speed", "merge.speedy", error="no game was played"),
]


def suite_in(file: Path) -> ElementTree.Element:
    root = ElementTree.parse(file).getroot()
    assert root.tag == "testsuites"
    (found,) = root
    return found


def test_write_junit__says_what_passed_and_why_the_rest_did_not(tmp_path: Path) -> None:
    write_junit(tmp_path / "junit.xml", "merge", CHECKS, {"version": "1"})
    suite = suite_in(tmp_path / "junit.xml")
    counts = {"tests": "3", "failures": "1", "errors": "1"}
    assert {name: suite.get(name) for name in ("name", *counts)} == {"name": "merge", **counts}
    assert [(each.get("name"), each.get("value")) for each in suite.iter("property")] == [("version", "1")]
    passed, *others = suite.findall("testcase")
    assert (passed.get("name"), passed.get("classname"), passed.get("time")) == ("failure rate", "merge.speedy", "1.5")
    assert [(each.tag, each.text) for each in passed] == [("system-out", "at most 0.2\nfound 0.1")]
    assert [(each[0].tag, each[0].get("message")) for each in others] == [
        ("failure", "12 of 100, more than 5"),
        ("error", "no game was played"),
    ]


def test_write_junit__characters_that_xml_forbids_are_escaped(tmp_path: Path) -> None:
    write_junit(tmp_path / "junit.xml", "a\x00b", [case_of("<&\x1b", "x", failure="\ud800")])
    (case,) = suite_in(tmp_path / "junit.xml").iter("testcase")
    assert case.get("name") == "<&\\x1b"
