"""`harness scene vary`: the same scene on other roads."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from harness.cli.app import app
from harness.errors import UsageError
from harness.road.scene.open_scene import open_scene
from tests.support.tiny import PAPER_MERGE


def vary(*arguments: object) -> list[str]:
    result = CliRunner().invoke(app, ["scene", "vary", *map(str, arguments)])
    if result.exception is not None:
        raise result.exception
    return result.output.splitlines()


def test_vary__writes_a_scene_that_is_in_order_and_says_how_its_road_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    wrote, then = vary(PAPER_MERGE, "--roads", 1, "--seed", 5, "--out", tmp_path)
    folder = tmp_path / "paper_merge_road5"
    assert wrote.startswith(f"wrote {folder}: lengths × ")
    assert then == f"Next: harness league --ego EGO --scenes {folder}"
    original, varied = open_scene(PAPER_MERGE), open_scene(folder)
    assert varied.document.name == "paper_merge_road5"
    stretch = float(wrote.split("lengths × ")[1].split(",")[0])
    routes, before = varied.world.road.routes, original.world.road.routes
    assert routes.goal_m / before.goal_m == pytest.approx([stretch, stretch], abs=0.02)
    assert original.document.ego.position_m is not None
    assert varied.document.ego.position_m == pytest.approx(
        [stretch * m for m in original.document.ego.position_m], rel=0.02
    )
    assert [each.name for each in folder.parent.iterdir()] == [folder.name], "nothing is left beside the scene"

    with pytest.raises(UsageError, match="is there already, and nothing is overwritten"):
        vary(PAPER_MERGE, "--roads", 2, "--seed", 4, "--out", tmp_path)


def test_vary__makes_the_folder(tmp_path: Path) -> None:
    vary(PAPER_MERGE, "--roads", 1, "--out", tmp_path / "new" / "roads")
    assert (tmp_path / "new" / "roads" / "paper_merge_road1" / "scene.toml").is_file()


def test_vary__a_scene_with_a_compressed_file_is_refused_before_a_road_is_drawn(tmp_path: Path) -> None:
    scene = Path(shutil.copytree(PAPER_MERGE, tmp_path / "scene"))
    routes = scene / "paper_merge.rou.xml"
    (scene / "paper_merge.rou.xml.gz").write_bytes(gzip.compress(routes.read_bytes()))
    document = scene / "scene.toml"
    document.write_text(document.read_text().replace(routes.name, f"{routes.name}.gz"))
    with pytest.raises(UsageError, match=r"paper_merge\.rou\.xml\.gz: is compressed"):
        vary(scene, "--out", tmp_path)
