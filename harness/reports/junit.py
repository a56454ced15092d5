"""Checks and their outcomes as a JUnit XML file, which CI systems show as tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from harness.errors import plain
from harness.files import write_atomically


@dataclass(frozen=True, kw_only=True)
class JUnitCase:
    """One check and its outcome. At most one of `failure` and `error` is given; without any it passed."""

    name: str
    group: str
    """What it belongs to: a dotted name, by which CI systems group checks."""
    failure: str = ""
    """Why it failed, in one sentence."""
    error: str = ""
    """Why it could not be carried out."""
    details: str = ""
    """Further lines, such as the figures that were compared."""
    seconds: float = 0.0


def write_junit(
    file: Path, suite: str, checks: Sequence[JUnitCase], properties: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Write a suite of checks. `properties` are facts of the whole suite, such as versions. Raises OSError."""
    report, tests = JUnitXml(plain(suite)), TestSuite(plain(suite))
    for name, value in properties.items():
        tests.add_property(plain(name), plain(value))
    for check in checks:
        tests.add_testcase(_case(check))
    report.add_testsuite(tests)
    report.update_statistics()
    write_atomically(file, report.tostring())


def _case(check: JUnitCase) -> TestCase:
    case = TestCase(plain(check.name), plain(check.group), check.seconds)
    kinds = ((Failure, check.failure), (Error, check.error))
    case.result = [kind(plain(message)) for kind, message in kinds if message]
    if check.details:
        case.system_out = "\n".join(plain(line) for line in check.details.splitlines())
    return case
