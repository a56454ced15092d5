"""The files `junit.xml` and `result.json` of a run, for CI."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from junitparser import TestCase

from harness.campaign.results.kept_results import RunResult
from harness.campaign.results.shown_result import Verdicts
from harness.campaign.storage.learned import did_not_learn
from harness.campaign.storage.manifest import FORMAT
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.competence import FINISHED
from harness.files import write_atomically
from harness.reports.acceptance_wording import TITLES, sentence
from harness.reports.junit import case_of, write_junit
from harness.reports.numbers import NO_SPACE

RESULT, JUNIT = "result.json", "junit.xml"


def write_ci_files(
    folder: RunFolder,
    manifest: Mapping[str, Any],
    checks: Sequence[Check] | None,
    verdicts: Verdicts,
    result: RunResult,
) -> None:
    """Write `result.json` and `junit.xml`: the acceptance checks, and whether every stage was carried out."""
    properties = {"harness": str(manifest["versions"].get("harness", "")), "campaign": manifest["name"]}
    cases = [*map(_acceptance_case, checks or ()), *_stage_cases(manifest)]
    write_junit(folder.path / JUNIT, f"harness campaign {manifest['name']}", cases, properties)
    document = {
        "format": FORMAT,
        "campaign": manifest["name"],
        "quick": manifest["quick"],
        "accepted": result.accepted,
        "exit_code": result.exit_code,
        "acceptance": [_record(check) for check in checks or ()],
        "verdicts": [
            {
                "persona": persona,
                **{name: getattr(verdict, name) for name in ("question", "label", "sentence")},
                "about": verdict.about.value if verdict.about is not None else "",
                "planned_tests": verdict.planned_tests,
            }
            for persona, verdict, _ in verdicts
        ],
        "failed_stages": list(result.failed_stages),
        "did_not_learn": [": ".join(each) for each in did_not_learn(manifest["stages"]).items()],
        "error_games": result.error_games,
        "versions": manifest["versions"],
    }
    write_record(folder.path / RESULT, document)


def write_record(file: Path, record: Mapping[str, Any]) -> None:
    """Write a file of JSON. Raises ValueError for NaN and infinity, which JSON does not have."""
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    write_atomically(file, (text + "\n").encode("utf-8", errors="backslashreplace"))


def _record(check: Check) -> dict[str, Any]:
    record = {name: getattr(check, name) for name in ("bound", "persona", "seed", "arm", "games")}
    numbers = {name: getattr(check, name) for name in ("value", "limit", "allowed")}
    known = {name: number if math.isfinite(number) else None for name, number in numbers.items()}
    return {**record, **known, "passed": check.passed}


def _acceptance_case(check: Check) -> TestCase:
    name, words = f"{TITLES[check.bound]}: {check.arm}, seed {check.seed}", sentence(check).replace(NO_SPACE, " ")
    group = f"acceptance.{check.persona}.{check.bound}"
    return case_of(name, group, failure="" if check.passed else words, details=words)


def _stage_cases(manifest: Mapping[str, Any]) -> list[TestCase]:
    cases = []
    for name, entry in manifest["stages"].items():
        finished = entry["status"] in FINISHED
        error = "" if finished else entry.get("message") or "it is not finished"
        if finished and entry.get("errors"):
            error = f"{entry['errors']} of {entry['episodes']} games could not be played"
        group, seconds = f"stages.{entry['kind']}", entry.get("seconds") or 0.0
        cases.append(case_of(name, group, error=error, seconds=seconds))
    return cases
