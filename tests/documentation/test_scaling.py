"""The script behind docs/scaling.md: how it lays a study out, and that the page shows its output."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import results, scale
from benchmarks.campaign import TimedStage


def stage(name: str, *needs: str, seconds: float) -> TimedStage:
    return TimedStage(id=name, seed=1, needs=needs, seconds=seconds)


@pytest.fixture
def fork() -> scale.Study:
    """Campaigns of 10 s, then 5 s and 7 s side by side, then a report of 3 s."""
    stages = [
        stage("naive", seconds=10.0),
        stage("short", "naive", seconds=5.0),
        stage("long", "naive", seconds=7.0),
    ]
    return scale.Study(stages=stages, kinds={}, report_s=3.0)


def test_study__its_work_and_critical_path(fork: scale.Study) -> None:
    assert fork.work_s == scale.SCENES * 25.0
    assert [each.id for each in fork.critical_path] == ["naive", "long"]
    assert fork.least_s == 20.0


@pytest.mark.parametrize(
    ("cores", "in_turn_s", "at_once_s"),
    [
        (1, 12 * 25.0, 12 * 25.0),
        (2, 12 * 20.0, 12 * 25.0 / 2),  # in turn, the second core is idle during the first stage and the report
        (1000, 12 * 20.0, 20.0),
    ],
)
def test_study__wall_time(fork: scale.Study, cores: int, in_turn_s: float, at_once_s: float) -> None:
    assert fork.in_turn_s(cores) == pytest.approx(in_turn_s)
    assert fork.at_once_s(cores) == pytest.approx(at_once_s)
    assert fork.at_once_s(cores, seeds_in_turn=False) == pytest.approx(at_once_s)


def test_page__shows_the_output_for_the_stored_results() -> None:
    """After a measurement: `python -m benchmarks scale --write`."""
    shown = scale.PAGE.read_text(encoding="utf-8").partition(scale.BEGIN)[2].partition(scale.END)[0]
    assert shown == scale.scale_text(results.read(results.RESULTS))


def test_write_page__replaces_the_tables_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"before\n{scale.BEGIN}old{scale.END}\nafter\n", encoding="utf-8")
    for text in ("first", "second"):
        monkeypatch.setattr(scale, "scale_text", lambda results, text=text: text)
        scale.write_page({}, page)
        assert page.read_text(encoding="utf-8") == f"before\n{scale.BEGIN}{text}{scale.END}\nafter\n"


def test_write_page__refuses_a_page_without_a_place_for_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scale, "scale_text", lambda results: "text")
    (tmp_path / "page.md").write_text("nothing\n", encoding="utf-8")
    with pytest.raises(ValueError, match="has no lines"):
        scale.write_page({}, tmp_path / "page.md")
