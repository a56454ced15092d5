"""The scripts behind docs/reproduction.md: their numbers, and that the page shows their output."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from pydantic import ValidationError

from harness.campaign.preflight import open_campaign
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

FOLDER = REPOSITORY / "docs" / "reproduction"

findings, sweep = script("reproduction/findings.py"), script("reproduction/sweep.py")

# --- the protocol -----------------------------------------------------------------------------------------------------


def protocol() -> Any:
    return read_document(findings.PROTOCOL, findings.Protocol)


def game(arm: str, failed: Any, speed: float = 10.0, non_ego: str = "goal", error: str | None = None) -> dict[str, Any]:
    cells = {"ego_failed": failed, "ego_mean_speed_mps": speed, "non_ego_outcome": non_ego}
    return {"arm": arm, "seed": 31, **cells, "error": error}


EPISODES = pd.DataFrame(
    [
        *[game("naive_alone", False, 10.0)] * 4,
        *[game("naive_vs_p", failed, 9.0, "collision" if failed else "goal") for failed in (True, True, False, False)],
        game("naive_vs_p", None, float("nan"), "error", "the simulator died"),
    ]
)
COMPARISONS = pd.DataFrame(
    [{"question": "RQ1", "persona": "p", "seed": 31, "metric": "failure", "p_holm": 0.02}, {"metric": "mean_speed"}]
)


@pytest.mark.parametrize(
    ("keys", "value", "holds", "words"),
    [
        # the game with an error is not one of the four
        ({"quantity": "failures", "arm": "naive_vs_p", "least": 0.5}, 0.5, True, ("failures", "at least 50%")),
        ({"quantity": "failures", "arm": "naive_vs_p", "most": 0.49}, 0.5, False, ("failures", "at most 49%")),
        (
            {"quantity": "speed_change", "arm": "naive_vs_p", "least": -0.2, "most": -0.05},
            -0.1,
            True,
            ("speed against naive_alone", "-20.0% to -5.0%"),
        ),
        # it counts as not reached in the game with an error
        ({"quantity": "goals", "arm": "naive_vs_p", "least": 0.5}, 0.4, False, ("the person's goal", "at least 50%")),
        ({"quantity": "p_holm", "question": "RQ1", "persona": "p", "most": 0.01}, 0.02, False, ("p", "at most 0.01")),
    ],
)
def test_expected__is_computed_from_the_games_without_errors(
    keys: dict[str, Any], value: float, holds: bool, words: tuple[str, str]
) -> None:
    expected = findings.Expected(**keys)
    found = expected.value(EPISODES, COMPARISONS)
    assert (found, expected.holds(found)) == (pytest.approx(value), holds)
    assert words[0] in expected.what
    assert expected.bound == words[1]


def test_expected__a_test_that_could_not_be_made_does_not_hold() -> None:
    assert not findings.Expected(quantity="p_holm", question="RQ1", persona="p", most=0.01).holds(float("nan"))


@pytest.mark.parametrize(
    "keys",
    [
        {"quantity": "failures", "arm": "naive_alone"},
        {"quantity": "p_holm", "arm": "naive_alone", "most": 0.1},
        {"quantity": "failures", "question": "RQ1", "persona": "p", "most": 0.1},
    ],
)
def test_expected__must_be_whole(keys: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        findings.Expected(**keys)


def test_protocol__is_about_the_files_that_are_here_and_the_arms_of_its_campaign() -> None:
    campaign = open_campaign(FOLDER / "ten-seeds.toml")
    assert campaign.document.seeds == protocol().seeds
    files = {file.name: file for file in (*(REPOSITORY / "personas").iterdir(), *campaign.scene.folder.iterdir())}
    for name, value in protocol().sha256.items():
        assert hashlib.sha256(files[name].read_bytes()).hexdigest() == value, name
    planned = {stage.id.partition("-seed")[0] for stage in campaign.stages}
    assert {each.arm for each in protocol().expected if each.arm} <= planned
    people = {persona.name for persona in campaign.personas}
    assert {each.persona for each in protocol().expected if each.persona} == people


def test_protocol__is_not_about_a_run_of_other_seeds_or_files() -> None:
    manifest = {"seeds": protocol().seeds, "hashes": {f"a/{name}": value for name, value in protocol().sha256.items()}}
    assert list(protocol().deviations(manifest)) == []
    changed = manifest | {"seeds": [1], "hashes": manifest["hashes"] | {"a/careful.toml": "0"}}
    seeds, persona = protocol().deviations(changed)
    assert seeds.startswith("training seeds [1], the protocol has [31,")
    assert persona.startswith("careful.toml has SHA-256 0, the protocol has ")


# --- the sweep --------------------------------------------------------------------------------------------------------


def levers() -> list[Any]:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    return [sweep.Setting(lever, value) for lever in document.levers for value in lever.values]


@pytest.mark.parametrize("setting", levers(), ids=lambda setting: setting.name)
def test_sweep__each_setting_is_a_campaign_that_differs_in_one_key(setting: Any, tmp_path: Path) -> None:
    document = read_document(FOLDER / "levers.toml", sweep.Sweep)
    campaign = open_campaign(sweep._write_campaign(FOLDER, document, setting, tmp_path / "documents"))
    shipped = FOLDER / document.campaign
    was = flat(read_document(shipped, Campaign), "campaign.")
    was |= flat(read_document(shipped.parent / "../personas/careful.toml", Persona), "ego.")
    was |= flat(read_document(FOLDER / setting.lever.persona, Persona), "")
    now = flat(campaign.document, "campaign.") | flat(campaign.ego_persona, "ego.") | flat(campaign.personas[0], "")
    always_changed = {"campaign.name", "campaign.scene", "campaign.ego.persona"}
    always_changed.add("campaign.seeds")  # levers are turned on seeds that are not published
    changed = {key for key in was | now if was.get(key) != now.get(key)} - always_changed
    assert {key.split("[")[0] for key in changed} - {"campaign.personas"} <= {setting.lever.key}
    assert now[setting.lever.key] == setting.value


def flat(document: Any, prefix: str) -> dict[str, Any]:
    """All plain values of a document by their dotted keys."""

    def walk(key: str, value: Any) -> dict[str, Any]:
        if isinstance(value, dict):
            return {k: v for name, each in value.items() for k, v in walk(f"{key}.{name}", each).items()}
        return {key: value}

    dumped = document.model_dump(mode="json")
    return {k: v for name, each in dumped.items() for k, v in walk(f"{prefix}{name}", each).items()}


def test_sweep__the_table_has_all_settings(tmp_path: Path) -> None:
    stored = pd.read_csv(FOLDER / "levers.csv", dtype=str)
    settings = set(stored[["persona", "key", "value"]].itertuples(index=False, name=None))
    assert settings == {(Path(each.lever.persona).stem, each.lever.key, str(each.value)) for each in levers()}
