"""The verdicts of a run as a table in Markdown: `python docs/publish/verdicts.py reports/merge/result.json`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from harness.reports.run_tables import QUESTIONS


def verdicts_table(result: dict[str, Any]) -> str:
    """A row for each person and question, and how many of the bounds are kept."""
    lines = ["| person | question | answer | games |", "| --- | --- | --- | --- |"]
    questions = {name: text.format(person="person", doing="retraining") for name, text in QUESTIONS.items()}
    for each in result["verdicts"]:
        question = f"{questions[each['question']]} ({each['question']})"
        lines.append(f"| {each['persona']} | {question} | {each['label']} | {each['sentence']} |")
    if bounds := result["acceptance"]:
        kept = sum(each["passed"] for each in bounds)
        missed = ", ".join(f"`{each['bound']}` against {each['persona']}" for each in bounds if not each["passed"])
        lines += ["", f"{kept} of {len(bounds)} bounds are kept{missed and f'; not kept: {missed}'}."]
    return "\n".join(lines)


if __name__ == "__main__":
    print(verdicts_table(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))))
