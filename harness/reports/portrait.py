"""A persona in one line: who it is, and what it does not see."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from harness.reports.numbers import percent

NO_BLIND_SPOT_CHECK = "It does not check the blind spot in {share} of drives."
LOOKS_AWAY = "Its eyes leave the road for {low:g} to {high:g} s at a time, about every {every:g} s."


def portrait(document: Mapping[str, Any]) -> str:
    """The line, from the persona's document in the manifest; empty without one."""
    sentences = [str(document.get("description", "")).strip()]
    share = (document.get("perception") or {}).get("no_blind_spot_check_share")
    if share:
        sentences.append(NO_BLIND_SPOT_CHECK.format(share=percent(share)))
    if attention := document.get("attention"):
        low, high = attention["lapse_s"]
        sentences.append(LOOKS_AWAY.format(low=low, high=high, every=attention["mean_attentive_s"] + (low + high) / 2))
    return " ".join(sentence for sentence in sentences if sentence)
