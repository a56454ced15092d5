"""JUnit XML files: their counts, messages and safety, read back by the standard library."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from harness.reports.junit import JUnitCase, write_junit

CHECKS = [
    JUnitCase(name="failure rate", group="merge.speedy", seconds=1.5, details="at most 0.2\nfound 0.1"),
    JUnitCase(name="near misses", group="merge.speedy", failure="12 of 100, more than 5"),
    JUnitCase(name="speed", group="merge.speedy", error="no game was played"),
    JUnitCase(name="gap", group="merge.speedy", skipped="not measured"),
]


@pytest.fixture
def suite(tmp_path: Path) -> ElementTree.Element:
    write_junit(tmp_path / "junit.xml", "merge", CHECKS, {"version": "1"})
    root = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert root.tag == "testsuites"
    found = root.find("testsuite")
    assert found is not None
    return found


def test_write_junit__counts_what_passed_and_what_did_not(suite: ElementTree.Element) -> None:
    assert {name: suite.get(name) for name in ("name", "tests", "failures", "errors", "skipped")} == {
        "name": "merge",
        "tests": "4",
        "failures": "1",
        "errors": "1",
        "skipped": "1",
    }


def test_write_junit__a_case_says_what_it_is_and_why_it_failed(suite: ElementTree.Element) -> None:
    passed, failed, *_ = suite.findall("testcase")
    assert (passed.get("name"), passed.get("classname"), passed.get("time")) == ("failure rate", "merge.speedy", "1.5")
    assert [each.tag for each in passed] == ["system-out"]
    assert passed.findtext("system-out") == "at most 0.2\nfound 0.1"
    failure = failed.find("failure")
    assert failure is not None
    assert failure.get("message") == "12 of 100, more than 5"


def test_write_junit__has_facts_of_the_whole_suite(suite: ElementTree.Element) -> None:
    assert [(each.get("name"), each.get("value")) for each in suite.iter("property")] == [("version", "1")]


def test_write_junit__characters_that_xml_forbids_are_escaped(tmp_path: Path) -> None:
    write_junit(tmp_path / "junit.xml", "a\x00b", [JUnitCase(name="<&\x1b", group="x", failure="\ud800")])
    root = ElementTree.parse(tmp_path / "junit.xml").getroot()
    case = next(root.iter("testcase"))
    assert case.get("name") == "<&\\x1b"
