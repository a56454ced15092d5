"""Checks and their outcomes as a JUnit XML file, which CI systems show as tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from harness.errors import plain
from harness.files import write_atomically


def case_of(
    name: str, group: str, *, failure: str = "", error: str = "", details: str = "", seconds: float = 0.0
) -> TestCase:
    """A check and its outcome; `group` is a dotted name, by which CI systems group checks. `failure` says in a sentence
    why it failed, `error` why it could not be carried out: at most one is given. `details` are further lines."""
    case = TestCase(plain(name), plain(group), seconds)
    case.result = [kind(plain(message)) for kind, message in ((Failure, failure), (Error, error)) if message]
    if details:
        case.system_out = "\n".join(plain(line) for line in details.splitlines())
    return case


def write_junit(
    file: Path, suite: str, checks: Iterable[TestCase], properties: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Write a suite of checks. `properties` are facts of the whole suite, such as versions. Raises OSError."""
    report, tests = JUnitXml(plain(suite)), TestSuite(plain(suite))
    for name, value in properties.items():
        tests.add_property(plain(name), plain(value))
    for check in checks:
        tests.add_testcase(check)
    report.add_testsuite(tests)
    report.update_statistics()
    write_atomically(file, report.tostring())
