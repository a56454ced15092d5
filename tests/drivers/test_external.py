"""External drivers as the ego: found, refused without permission, identified, and played in rounds 0 and 1."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import TrainingStage
from harness.campaign.preflight import open_campaign
from harness.config.driver import KINDS
from harness.config.toml_reading import tomllib
from harness.drivers.external import ALLOW_CODE
from harness.drivers.policy_file import write_policy
from harness.errors import UsageError
from harness.shipped_documents import shipped, shipped_policies
from tests.support.external_drivers import document, find, install, problems
from tests.support.policies import some_policy
from tests.support.repository import REPOSITORY
from tests.support.shipped import FOLDER, NAIVE, NAIVE_BY_NAME
from tests.support.tiny import CAREFUL, PAPER_MERGE, SPEEDY, TRAINING, harness, write_campaign

PERL = REPOSITORY / "egos" / "examples" / "process"
ADAS, RSS = (REPOSITORY / "egos" / f"{name}.toml" for name in ("adas", "rss"))


def refusal(written: str, folder: Path, allow_code: bool = True) -> str:
    with pytest.raises(UsageError) as caught:
        find(written, folder, allow_code)
    return str(caught.value)


def ego(driver: object) -> dict[str, Any]:
    return {"driver": str(driver), "persona": str(CAREFUL)}


# --- finding it ---


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('kind = "proces"', "mine.toml: kind: there is no kind of driver 'proces' (did you mean 'process'?)"),
        ("", "mine.toml: kind: is missing"),
        ('kind = "process"', "mine.toml: command: is missing"),
        ('kind = "process"\ncomand = ["perl"]\ncommand = ["perl"]', "comand: unknown key (did you mean 'command'?)"),
        ('kind = "process"\ncommand = ["no-such-program"]', "there is no executable program 'no-such-program' on PATH"),
        ('kind = "process"\ncommand = ["./drive"]', "command: there is no executable program './drive' in "),
        ('kind = "process"\ncommand = ["perl"]\nfiles = ["mine.tml"]', "(did you mean 'mine.toml'?)"),
        ('kind = "process"\ncommand = ["perl"]\ndeadline_s = 0', "deadline_s: 0 is not possible"),
        ('kind = "fmu"\nfile = "twin.fmu"', "file: 'twin.fmu': there is no such file"),
        ('kind = "fmu"\nfile = "mine.toml"\n[inputs]\nv = "speed_mp"', "did you mean 'speed_mps'?"),
        ('kind = "fmu"\nfile = "mine.toml"\n[outputs]\nsteering = "a"', "did you mean 'steering_rad'?"),
        ('kind = "stable_baselines3"\nfile = "mine.toml"\nalgorithm = "ARS"', "algorithm: 'ARS' is not possible"),
        ('kind = "python"\nentry_point = "nobody"', "entry_point: no installed package provides a driver 'nobody'"),
    ],
)  # fmt: skip
def test_find__a_wrong_document_is_an_error_with_its_key(text: str, message: str, tmp_path: Path) -> None:
    assert message in refusal(document(tmp_path, text), tmp_path)


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("twin.fmu", 'kind = "fmu", file = "twin.fmu"'),
        ("mine.onnx", 'kind = "onnx", file = "mine.onnx"'),
        ("drive.py", 'kind = "process", command = ["./drive.py"]'),
    ],
)
def test_find__a_file_without_a_document_gets_the_document_as_remedy(name: str, keys: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"PK")
    told = refusal(name, tmp_path)
    assert f"{name!r} is a file, and no driver document (name a TOML document with {keys} (docs/egos.md))" in told


def test_find__an_archive_of_another_library_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "mine.pkl").write_bytes(b"PK")
    assert "can carry pickles" in refusal("mine.pkl", tmp_path)
    (tmp_path / "model.zip").write_bytes(b"PK")
    told = refusal("model.zip", tmp_path)
    assert "can carry pickles" in told
    assert 'kind = "stable_baselines3", file = "model.zip"' in told


def test_find__a_missing_path_gets_the_nearest_as_remedy(tmp_path: Path) -> None:
    document(tmp_path, "", "idm.toml")
    assert "'imd.toml': there is no such file or folder (did you mean 'idm.toml'?)" in refusal("imd.toml", tmp_path)
    assert "no folder" in refusal("nowhere/idm.toml", tmp_path)


def test_find__a_shipped_policy_has_a_name_in_every_folder(tmp_path: Path) -> None:
    assert find(NAIVE_BY_NAME, tmp_path).place == shipped("policies") / FOLDER / NAIVE
    campaign = open_campaign(write_campaign(tmp_path, ego=ego(NAIVE_BY_NAME)))
    assert campaign.ego_driver == find(NAIVE_BY_NAME, tmp_path)
    own = tmp_path / "policies" / FOLDER / NAIVE
    write_policy(some_policy(), own)
    assert find(NAIVE_BY_NAME, tmp_path).place == own


def test_find__an_unknown_policy_gets_the_shipped_ones_of_its_folder_as_remedy(tmp_path: Path) -> None:
    told = refusal(f"{FOLDER}/naive-seed2", tmp_path)
    assert {name for name in shipped_policies() if name in told} == {
        name for name in shipped_policies() if name.startswith(f"{FOLDER}/")
    }


@pytest.mark.parametrize("written", ["mine/naive-seed1", "qqq"])
def test_find__an_unknown_policy_of_no_shipped_folder_gets_one_of_each_as_remedy(written: str, tmp_path: Path) -> None:
    told = refusal(written, tmp_path)
    named = [name.partition("/")[0] for name in shipped_policies() if name in told]
    assert named == sorted({name.partition("/")[0] for name in shipped_policies()})


@pytest.mark.parametrize(
    "text",
    [
        'kind = "process"\ncommand = ["perl"]',
        'kind = "fmu"\nfile = "mine.toml"',
        'kind = "stable_baselines3"\nfile = "mine.toml"\nalgorithm = "PPO"',
    ],
)
def test_find__code_in_a_file_needs_permission_on_the_command_line(text: str, tmp_path: Path) -> None:
    name = document(tmp_path, text)
    message = refusal(name, tmp_path, allow_code=False)
    assert len(message.splitlines()) == 1
    assert "a document can't give the permission" in message
    assert ALLOW_CODE in message
    find(name, tmp_path, allow_code=True)
    assert "unknown key" in refusal(document(tmp_path, f"{text}\nallow_code = true"), tmp_path)


def test_find__identity_of_a_program_has_all_its_files(tmp_path: Path) -> None:
    shutil.copytree(PERL, tmp_path / "perl")
    (tmp_path / "perl" / "map.csv").write_text("1\n")
    text = (PERL / "perl.toml").read_text()
    (tmp_path / "perl" / "perl.toml").write_text(text + 'files = ["map.csv"]\n')
    found = [find("perl/perl.toml", tmp_path)]
    assert {Path(file).name for file in found[0].files} >= {"drive.pl", "map.csv"}
    assert found[0].command[1:] == ("drive.pl",)
    for name in ("drive.pl", "map.csv"):
        (tmp_path / "perl" / name).write_text((tmp_path / "perl" / name).read_text() + "\n")
        found.append(find("perl/perl.toml", tmp_path))
    (tmp_path / "perl" / "perl.toml").write_text(text)
    found.append(find("perl/perl.toml", tmp_path))
    identities = [each.identity for each in found]
    assert all(identities.count(each) == 1 for each in identities)


@pytest.mark.parametrize(
    "text",
    [
        'kind = "process"\ncommand = ["perl"]\nfolder = "elsewhere"',
        'kind = "fmu"\nfile = "mine.toml"',
        'kind = "stable_baselines3"\nfile = "mine.toml"\nalgorithm = "PPO"',
        'kind = "python"\nentry_point = "steady"',
    ],
)
def test_find__files_of_every_kind_are_relative_to_the_document_and_hashed(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path / "site")
    monkeypatch.syspath_prepend(tmp_path / "site")
    (tmp_path / "egos" / "elsewhere").mkdir(parents=True)
    (tmp_path / "egos" / "weights.bin").write_bytes(b"one")
    document(tmp_path / "egos", text + '\nfiles = ["weights.bin"]')
    before = find("egos/mine.toml", tmp_path)
    assert str(tmp_path / "egos" / "weights.bin") in before.files
    (tmp_path / "egos" / "weights.bin").write_bytes(b"two")
    assert find("egos/mine.toml", tmp_path).identity != before.identity
    moved = before.document_in(tmp_path / "run" / "policies")
    assert getattr(moved, "files") == ["../../egos/weights.bin"]  # noqa: B009 - a kind of document with files
    document(tmp_path / "egos", text + '\nfiles = ["wieghts.bin"]')
    assert "files: 'wieghts.bin': there is no such file (did you mean 'weights.bin'?)" in refusal(
        "egos/mine.toml", tmp_path
    )


@pytest.mark.parametrize(
    "text", ['kind = "python"\nentry_point = "steady"\nfiles = ["large.bin"]', 'kind = "fmu"\nfile = "large.bin"']
)
def test_find__a_file_of_more_than_2_gb_is_refused(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path / "site")
    monkeypatch.syspath_prepend(tmp_path / "site")
    (tmp_path / "large.bin").touch()
    os.truncate(tmp_path / "large.bin", 8_000_000_000)  # sparse: it takes no room on the disk
    message = refusal(document(tmp_path, text), tmp_path)
    assert message.endswith("large.bin: is too large: 8,000 MB, at most 2,000 MB are read (name a smaller file)")


def test_find__a_parameter_that_is_the_path_of_a_file_is_hashed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path / "site")
    monkeypatch.syspath_prepend(tmp_path / "site")
    (tmp_path / "weights.bin").write_bytes(b"one")
    name = document(tmp_path, 'kind = "python"\nentry_point = "steady"\n[parameters]\nweights = "weights.bin"')
    before = find(name, tmp_path).identity
    (tmp_path / "weights.bin").write_bytes(b"two")
    assert find(name, tmp_path).identity != before


def test_find__a_link_is_not_resolved(tmp_path: Path) -> None:
    (tmp_path / "python").symlink_to(shutil.which("perl") or "")
    found = find(document(tmp_path, 'kind = "process"\ncommand = ["./python"]'), tmp_path)
    assert found.command == (str(tmp_path / "python"),)


# --- the campaign's check ---


def test_open_campaign__makes_a_test_decision_before_anything_runs(tmp_path: Path) -> None:
    text = 'kind = "process"\ncommand = ["perl", "-e", "die qq(no road today)"]'
    (message,) = problems(write_campaign(tmp_path, ego=ego(document(tmp_path, text))))
    assert "the test decision failed" in message
    assert "no road today" in message


def keys(folder: Path, driver: object) -> dict[str, str]:
    opened = open_campaign(write_campaign(folder, ego=ego(driver)), allow_code=True)
    stages = plan(opened.document, [each.name for each in opened.personas], opened.tunable)
    return stage_keys(opened, stages)


def test_keys__depend_on_the_driver(tmp_path: Path) -> None:
    shutil.copy(ADAS, tmp_path / "adas.toml")
    first, again = keys(tmp_path, "adas.toml"), keys(tmp_path, "adas.toml")
    assert first == again
    (tmp_path / "adas.toml").write_text(ADAS.read_text().replace("time_gap_s = 1.5", "time_gap_s = 1.6"))
    assert not set(first.values()) & set(keys(tmp_path, "adas.toml").values())


@pytest.mark.parametrize(
    "driver",
    [RSS, PERL / "perl.toml", "types.toml", "policy"],
    ids=["rules", "process", "sumo", "policy"],
)
def test_plan__an_ego_without_tunable_parameters_gets_rounds_0_and_1(driver: object, tmp_path: Path) -> None:
    document(tmp_path, 'kind = "sumo"\nvehicle_type = "ego_car"', "types.toml")
    write_policy(some_policy(), tmp_path / "policy")
    opened = open_campaign(write_campaign(tmp_path, ego=ego(driver)), allow_code=True)
    stages = plan(opened.document, ["speedy"], opened.tunable)
    arms = [f"{name}-seed1" for name in ("naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy")]
    assert [stage.id for stage in stages if isinstance(stage, TrainingStage)] == ["speedy-seed1"]
    assert [stage.id for stage in stages if not isinstance(stage, TrainingStage)] == arms


# --- whole campaigns ---


def played(folder: Path, driver: object, *options: object, **changes: Any) -> tuple[Path, dict[str, Any], pd.DataFrame]:
    training = {**TRAINING, "steps": 1024}
    campaign = write_campaign(folder, ego=ego(driver), training=training, assessment={"episodes": 2}, **changes)
    run = folder / "run"
    done = harness("campaign", campaign, "--out", run, *options)
    assert done.returncode == 0, done.stdout + done.stderr
    episodes = pd.read_csv(run / "episodes.csv", keep_default_na=False)
    return run, json.loads((run / "manifest.json").read_text()), episodes


def check_rounds(run: Path, manifest: dict[str, Any], episodes: pd.DataFrame, in_words: str) -> None:
    """The non-ego was trained against the ego, all arms were assessed, and the report names the ego and the rounds."""
    assert {entry["status"] for entry in manifest["stages"].values()} == {"done"}
    assert set(episodes["arm"]) == {"naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy"}
    assert set(episodes["error"]) == {""}
    assert manifest["ego_driver"]["in_words"] == in_words
    page = html.unescape((run / "report.html").read_text())
    assert in_words in page
    assert "0 and 1: this ego has nothing to train or to tune" in page
    assert "Round 2 was not played: the campaign trains and tunes no ego in it." in page
    assert in_words in (run / "policies" / "speedy-seed1" / "README.md").read_text()


@pytest.mark.slow
def test_campaign__with_rules(tmp_path: Path) -> None:
    run, manifest, episodes = played(tmp_path, RSS)
    check_rounds(run, manifest, episodes, f"the rules rss ({RSS})")
    assert manifest["ego_driver"]["document"]["name"] == "rss"


@pytest.mark.slow
def test_campaign__with_a_program(tmp_path: Path) -> None:
    shutil.copytree(PERL, tmp_path / "perl")
    text = 'kind = "process"\ncommand = ["perl", "drive.pl"]\ndeadline_s = 60.0\n'
    (tmp_path / "perl" / "perl.toml").write_text(text)
    run, manifest, episodes = played(tmp_path, "perl/perl.toml", "--allow-code")
    check_rounds(run, manifest, episodes, "the program perl drive.pl (perl/perl.toml)")
    assert set(manifest["ego_driver"]["files"]) > {"drive.pl"}
    refused = harness("campaign", tmp_path / "tiny.toml", "--out", run)
    assert refused.returncode == 2
    assert "--allow-code" in refused.stderr


@pytest.mark.slow
def test_campaign__with_sumos_models(tmp_path: Path) -> None:
    shutil.copytree(PAPER_MERGE, tmp_path / "merge")
    routes = tmp_path / "merge" / "paper_merge.rou.xml"
    idm = '<vType id="idm" carFollowModel="IDM" length="4.2" maxSpeed="40" speedFactor="1" speedDev="0"/>'
    routes.write_text(routes.read_text().replace("<route id", f"{idm}\n<route id", 1))
    driver = document(tmp_path, 'kind = "sumo"\nvehicle_type = "idm"', "idm.toml")
    run, manifest, episodes = played(tmp_path, driver, scene="merge")
    check_rounds(run, manifest, episodes, "SUMO's own models of vehicle type idm (idm.toml)")
    trace = pd.read_parquet(run / "traces" / "naive_alone-seed1.parquet")
    assert set(trace.loc[trace["player"] == "ego", "vehicle_type"]) == {"idm"}


@pytest.mark.slow
def test_campaign__games_in_which_a_program_crashes_are_errors(tmp_path: Path) -> None:
    """The program crashes at 12.5 m/s in every game: training against it fails with the reason."""
    crashing = (
        (PERL / "drive.pl").read_text().replace("my $steering", "die 'too fast' if $speed > 12.5; my $steering", 1)
    )
    shutil.copytree(PERL, tmp_path / "perl")
    (tmp_path / "perl" / "drive.pl").write_text(crashing)
    campaign = write_campaign(tmp_path, ego=ego("perl/perl.toml"), personas=[str(SPEEDY)], assessment={"episodes": 4})
    done = harness("campaign", campaign, "--out", tmp_path / "run", "--allow-code")
    assert done.returncode == 1, done.stdout + done.stderr
    episodes = pd.read_csv(tmp_path / "run" / "episodes.csv", keep_default_na=False)
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert "too fast" in manifest["stages"]["speedy-seed1"]["message"]
    assert manifest["stages"]["speedy-seed1"]["status"] == "failed"
    assert set(episodes["arm"]) == {"naive_alone", "naive_vs_sumo"}
    assert set(episodes["ego_outcome"]) == {"error"}
    assert episodes["error"].str.contains("DriverError: .*too fast").all()
    assert "too fast" in done.stdout.partition("games could not be played")[2].splitlines()[1]


# --- the page about egos ---


def test_page__has_a_valid_document_of_each_kind() -> None:
    pages = sorted((REPOSITORY / "docs").glob("egos*.md"))
    page = "".join(each.read_text() for each in pages)
    blocks = [block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "kind =" in block]
    kinds = {KINDS[table["kind"]].model_validate(table).kind for table in map(tomllib.loads, blocks)}  # type: ignore[attr-defined]
    assert kinds == set(KINDS) - {"rules"}
