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

PAGE = """# A page

<!-- output of: python table.py reports/one -->

| old |

<!-- end of output -->

In between.

<!-- output of: python table.py reports/two -->
<!-- end of output -->
"""

publish, output_blocks, cost = (script(f"publish/{name}.py") for name in ("publish", "output_blocks", "cost"))


def test_blocks__are_found_by_their_command() -> None:
    assert output_blocks.blocks_in(PAGE) == {
        "python table.py reports/one": "| old |",
        "python table.py reports/two": "",
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
        (tmp_path / folder).mkdir(parents=True)
        for name in names:
            (tmp_path / folder / name).write_text(folder)
    step = publish.Step.model_validate({"copy": "reports/merge/policies", "to": "policies/merge"})
    publish.carry_out(step, tmp_path)
    found = {each.name: each.read_text() for each in (tmp_path / "policies" / "merge").iterdir()}
    assert found == {"a": "reports/merge/policies", "b": "reports/merge/policies"}
    assert [each.name for each in (tmp_path / "policies").iterdir()] == ["merge"]


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
    with pytest.raises(ValueError, match=r"a step has one of|belong together|belongs to"):
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
    blocks = [command for page in publish.DOCUMENTS for command in output_blocks.blocks_in(page.read_text("utf-8"))]
    assert len(blocks) >= 8
    scripts = [command.split()[1] for command in blocks if not command.startswith("python -m ")]
    assert [name for name in scripts if not (REPOSITORY / name).is_file()] == []


def test_documents__show_what_the_stored_tables_hold(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks of commands that read one file that is in the repository; run folders are not, or in parts."""
    monkeypatch.chdir(REPOSITORY)
    blocks = {k: v for page in publish.DOCUMENTS for k, v in output_blocks.blocks_in(page.read_text("utf-8")).items()}
    shown = {
        k: v
        for k, v in blocks.items()
        if k.endswith((".csv", ".json")) and "--out" not in k and Path(k.split()[-1]).is_file()
    }
    assert len(shown) >= 4
    for command, block in shown.items():
        monkeypatch.setattr(sys, "argv", command.split()[1:])
        with contextlib.suppress(SystemExit):
            runpy.run_path(sys.argv[0], run_name="__main__")
        assert capsys.readouterr().out.strip() == block, command


def test_cost__counts_trainings_steps_and_arms_of_the_plan() -> None:
    merge = REPOSITORY / "campaigns" / "merge.toml"
    header, _, row, total = cost.cost_table([merge], REPOSITORY).splitlines()
    cells = dict(zip(header.split("|"), row.split("|"), strict=True))
    assert [cells[f" {name} "].strip() for name in ("trainings", "steps", "arms")] == ["5", "15.0 M", "10"]
    hours = float(cells[" core-hours "])
    assert 0.05 < hours < 1.0
    assert float(total.split("|")[5]) == hours


def test_cost__of_a_campaign_whose_policies_an_earlier_step_makes(tmp_path: Path) -> None:
    shutil.copytree(REPOSITORY / "networks" / "merge", tmp_path / "networks" / "merge")
    shutil.copytree(REPOSITORY / "personas", tmp_path / "personas")
    demo = tmp_path / "campaigns" / "merge-demo.toml"
    demo.parent.mkdir()
    shutil.copyfile(REPOSITORY / "campaigns" / "merge-demo.toml", demo)
    (tmp_path / "benchmarks").mkdir()
    shutil.copyfile(REPOSITORY / "benchmarks" / "results.json", tmp_path / "benchmarks" / "results.json")
    not_made_yet = cost.cost_table([demo], tmp_path).splitlines()
    cells = not_made_yet[2].split("|")
    assert [cells[1].strip(), cells[4].strip()] == ["campaigns/merge-demo.toml", "10"]
    (tmp_path / "policies" / "merge").mkdir(parents=True)  # empty: as those of an older version, left unread
    assert cost.cost_table([demo], tmp_path).splitlines() == not_made_yet
