"""`harness new`: a project that is in order, and nothing that is there is touched."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.campaign.preflight import open_campaign
from harness.cli import new_documents
from harness.cli.new_documents import create_project
from harness.errors import UsageError


def test_create_project__its_campaign_is_in_order_and_uses_its_own_documents(tmp_path: Path) -> None:
    files = create_project(tmp_path / "lab")
    assert all(file.is_file() for file in files)
    campaign = open_campaign(tmp_path / "lab" / "campaign.toml")
    assert campaign.document.name == "lab"
    assert campaign.scene.folder == tmp_path / "lab" / "networks" / "merge"
    assert [persona.name for persona in campaign.personas] == ["speedy", "my_driver"]
    assert "personas/my_driver.toml" in campaign.hashes


@pytest.mark.parametrize(
    ("name", "message"), [("my lab", "can't be the name of a campaign"), ("x/lab", "there is no folder")]
)
def test_create_project__a_bad_folder_is_refused(name: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=message):
        create_project(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_create_project__a_folder_with_files_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "mine.txt").touch()
    with pytest.raises(UsageError, match="not empty"):
        create_project(tmp_path / "lab")
    assert [each.name for each in (tmp_path / "lab").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("is_there", [False, True])
def test_create_project__without_room_for_all_files_there_are_none(
    is_there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device", str(path))

    if is_there:
        (tmp_path / "lab").mkdir()
    monkeypatch.setattr(new_documents, "write_atomically", full)
    with pytest.raises(UsageError, match="lab: can't be written: No space left"):
        create_project(tmp_path / "lab")
    assert list(tmp_path.rglob("*")) == [tmp_path / "lab"] * is_there
