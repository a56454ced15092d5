"""A conclusion as a persona's card shows it: an ego that fails less, but comes too close, is not simply mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.reports.key_figures import KeyFigure
from harness.reports.wording import Conclusion, Tone

PARTLY = "Partly"
CAUTION = "But {title}: {line}."


@dataclass(frozen=True, kw_only=True)
class ShownVerdict:
    """A conclusion with its question in plain words."""

    question: str
    conclusion: Conclusion
    label: str
    tone: Tone
    caution: str = ""
    """What the answer does not say; empty if nothing."""


def shown_verdict(question: str, conclusion: Conclusion, figures: Sequence[KeyFigure]) -> ShownVerdict:
    """The conclusion with a caution where a key figure warns of an ego that is otherwise mended."""
    label = conclusion.label[:1].upper() + conclusion.label[1:]
    warnings = [each for each in figures if each.warns]
    if conclusion.tone != "mended" or not warnings:
        return ShownVerdict(question=question, conclusion=conclusion, label=label, tone=conclusion.tone)
    caution = " ".join(CAUTION.format(title=each.title.lower(), line=each.lines[-1]) for each in warnings)
    return ShownVerdict(question=question, conclusion=conclusion, label=PARTLY, tone="open", caution=caution)
