"""The policy.json of each policy that a run trained."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field, ValidationError

from harness.campaign.storage.run_folder import RunFolder
from harness.config.toml_reading import Document
from harness.drivers.policy_file import policy_files, read_card
from harness.errors import UsageError


class _PolicyCard(Document):
    """The part of a policy's JSON that a card uses."""

    model_config = ConfigDict(extra="ignore")
    player: Literal["ego", "non_ego"]
    scene: str = Field(max_length=1000)
    against: str | None = Field(max_length=1000)
    began_from: str | None = Field(max_length=1000)
    training: dict[str, bool | int | float | str | list[int] | None]


def trained_policies(folder: RunFolder, manifest: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The content of the policy.json of every policy that a run trained, by stage. Raises UsageError where a file is
    damaged."""
    return {
        stage: _policy_card(folder.policy(stage))
        for stage, entry in manifest["stages"].items()
        if entry["kind"] == "training" and entry["status"] == "done"
    }


def _policy_card(folder: Path) -> dict[str, Any]:
    """The content of a policy's JSON. Raises UsageError where it does not have the form that a training writes."""
    card = read_card(folder)
    try:
        _PolicyCard.model_validate(card)
    except ValidationError as error:
        key, message = ".".join(map(str, error.errors()[0]["loc"])), error.errors()[0]["msg"]
        raise UsageError.of(policy_files(folder)[0], key, f"is damaged: {message}", "train the policy again") from None
    return card
