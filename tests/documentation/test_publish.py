"""`make publish`: its steps, the parts of documents that it writes, and what it says that it costs."""

from __future__ import annotations

import contextlib
import runpy
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from tests.support.repository import REPOSITORY
from tests.support.scripts import script
from tests.support.tiny import write_campaign

PAGE = """# A page

<!-- output of: python table.py reports/one -->

| old |

<!-- end of output -->

In between.

<!-- output of: python table.py reports/two -->
<!-- end of output -->
"""

publish, output_blocks, cost = (script(f"publish/{name}.py") for name in ("publish", "output_blocks", "cost"))
BLOCKS = {
    command: output
    for page in publish.DOCUMENTS
    for command, output in output_blocks.blocks_in(page.read_text("utf-8")).items()
}


def test_outputs__replace_those_of_their_command_and_nothing_else() -> None:
    page = output_blocks.with_outputs(PAGE, {"python table.py reports/two": "| \\1 new |\n"})
    assert output_blocks.blocks_in(page) == {
        "python table.py reports/one": "| old |",
        "python table.py reports/two": "| \\1 new |",
    }
    assert page.replace("\n| \\1 new |\n\n", "") == PAGE
    assert output_blocks.with_outputs(page, {"python table.py reports/two": "| \\1 new |"}) == page


def test_write_outputs__runs_the_commands_whose_run_folders_are_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "reports" / "one").mkdir(parents=True)
    (tmp_path / "table.py").write_text("import sys; print('| new:', sys.argv[1], '|')")
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    publish.write_outputs(page, tmp_path, [""])
    assert output_blocks.blocks_in(page.read_text()) == {
        "python table.py reports/one": "| new: reports/one |",
        "python table.py reports/two": "",
    }
    assert "reports/two is not there" in capsys.readouterr().out


def test_carry_out__a_copied_folder_replaces_the_one_before(tmp_path: Path) -> None:
    for folder, names in {"reports/merge/policies": ["a", "b"], "policies/merge": ["b", "c"]}.items():
        for name in names:
            (tmp_path / folder / name).mkdir(parents=True)
            (tmp_path / folder / name / "policy.json").write_text(folder)
    step = publish.Step.model_validate({"copy": "reports/merge/policies", "to": "policies/merge"})
    publish.carry_out(step, tmp_path)
    found = {each.name: (each / "policy.json").read_text() for each in (tmp_path / "policies" / "merge").iterdir()}
    assert found == {"a": "reports/merge/policies", "b": "reports/merge/policies"}
    assert [each.name for each in (tmp_path / "policies").iterdir()] == ["merge"]


@pytest.mark.parametrize(
    ("policies", "people"),
    [
        (["naive", "anna", "careful", "retrained_anna", "bert"], ["anna", "bert"]),
        (["naive", "people", "anna", "bert", "robust"], ["people"]),
    ],
)
def test_people__of_a_run_are_its_personas_or_their_one_network_from_its_first_three_trainings(
    tmp_path: Path, policies: list[str], people: list[str]
) -> None:
    for name in policies:
        for seed in (11, 12, 13, 14):
            (tmp_path / "policies" / f"{name}-seed{seed}").mkdir(parents=True)
    (tmp_path / "manifest.json").write_text('{"personas": ["anna", "bert"], "baseline": "careful"}')
    expected = [f"{name}-seed{seed}" for name in people for seed in (11, 12, 13)]
    assert [each.name for each in publish.people_of(tmp_path)] == expected


def test_carry_out__packs_the_run_folder_that_has_the_name_of_the_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands, packed = list[str](), list[Path]()
    monkeypatch.setattr(publish, "_run", lambda command, *_, **__: commands.append(command))
    monkeypatch.setattr(publish, "pack", packed.append)
    write_campaign(tmp_path, name="other").rename(tmp_path / "campaign.toml")
    publish.carry_out(publish.Step(campaign="campaign.toml", pack=True), tmp_path)
    assert (commands, packed) == (["harness campaign campaign.toml"], [tmp_path / "reports" / "other"])


def test_carry_out__the_long_tables_of_a_packed_run_are_compressed(tmp_path: Path) -> None:
    for name in publish.LONG_TABLES:
        (tmp_path / f"{name}.csv").write_bytes(b"arm,seed\nnaive_alone,1\n")
    publish.pack(tmp_path)
    for name in publish.LONG_TABLES:
        assert pd.read_csv(tmp_path / f"{name}.csv.gz").to_dict("list") == {"arm": ["naive_alone"], "seed": [1]}


@pytest.mark.parametrize(
    "keys",
    [{"pack": True, "copy": "a", "to": "b"}, {}, {"campaign": "a.toml", "command": "python b.py"}, {"copy": "a"}],
    ids=str,
)
def test_step__is_one_of_three(keys: dict[str, str]) -> None:
    with pytest.raises(ValueError, match=r"a step has one of|belong together|belong to"):
        publish.Step.model_validate(keys)


def test_steps__name_campaigns_and_scripts_that_exist() -> None:
    steps = publish.read_document(publish.PUBLISHED, publish.Published).step
    commands = [each.command.split() for each in steps if each.command]
    named = [each.campaign for each in steps if each.campaign] + [
        file for program, file, *_ in commands if program == "python"
    ]
    assert [name for name in named if not (REPOSITORY / name).is_file()] == []
    shipped = {path.relative_to(REPOSITORY).as_posix() for path in (REPOSITORY / "campaigns").glob("*.toml")}
    assert shipped <= set(named)


def test_documents__every_block_is_of_a_command_that_exists() -> None:
    scripts = [command.split()[1] for command in BLOCKS if not command.startswith("python -m ")]
    assert [name for name in scripts if not (REPOSITORY / name).is_file()] == []


def test_documents__show_what_the_stored_tables_hold(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks of commands that read one file that is in the repository; run folders are not, or in parts."""
    monkeypatch.chdir(REPOSITORY)
    shown = [each for each in BLOCKS if each.endswith((".csv", ".json")) and "--out" not in each]
    shown = [each for each in shown if Path(each.split()[-1]).is_file()]
    assert len(shown) >= 4
    for command in shown:
        monkeypatch.setattr(sys, "argv", command.split()[1:])
        with contextlib.suppress(SystemExit):
            runpy.run_path(sys.argv[0], run_name="__main__")
        assert capsys.readouterr().out.strip() == BLOCKS[command], command


def test_cost__counts_trainings_steps_and_arms_of_the_plan() -> None:
    campaign = REPOSITORY / "campaigns" / "paper_merge.toml"
    header, _, row, total = cost.cost_table([campaign], REPOSITORY).splitlines()
    cells = dict(zip(header.split("|"), row.split("|"), strict=True))
    assert [cells[f" {name} "].strip() for name in ("trainings", "steps", "arms")] == ["5", "15.0 M", "11"]
    hours = float(cells[" core-hours "])
    assert 0.05 < hours < 1.0
    assert float(total.split("|")[5]) == hours


def test_cost__of_a_campaign_whose_policies_an_earlier_step_makes(tmp_path: Path) -> None:
    campaign = write_campaign(tmp_path, policies="policies/later", training=None)
    (tmp_path / "benchmarks").mkdir()
    shutil.copyfile(REPOSITORY / "benchmarks" / "results.json", tmp_path / "benchmarks" / "results.json")
    row = cost.cost_table([campaign], tmp_path).splitlines()[2]
    assert [cell.strip() for cell in row.split("|")][1:5] == ["tiny.toml", "0", "0.0 M", "6"]
