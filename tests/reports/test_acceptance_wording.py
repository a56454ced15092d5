"""The bounds of a campaign in words."""

from __future__ import annotations

from harness.reports.acceptance_wording import Line, by_sentence


def line(bound: str, who: str, sentence: str, *, passed: bool = False) -> Line:
    return Line(passed=passed, title=f"{bound}, {who}", who=who, sentence=sentence)


def test_lines_that_say_the_same__are_one_and_name_all_bounds_of_somebody_at_once() -> None:
    not_measured = "not measured: nobody was there"
    lines = [
        line("failures", "anna, seed 1", not_measured),
        line("near misses", "anna, seed 1", not_measured),
        line("failures", "bert, seed 1", not_measured),
        line("near misses", "bert, seed 1", "2 %", passed=True),
    ]
    assert [(each.title, each.sentence, each.passed) for each in by_sentence(lines)] == [
        ("all bounds, anna, seed 1; failures, bert, seed 1", not_measured, False),
        ("near misses, bert, seed 1", "2 %", True),
    ]


def test_the_only_bound_of_somebody__is_named() -> None:
    assert [each.title for each in by_sentence([line("failures", "anna", "3 %")])] == ["failures, anna"]
