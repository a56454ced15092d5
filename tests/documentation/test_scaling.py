"""The script behind docs/scaling.md: how it lays a study out, and that the page shows its output."""

from __future__ import annotations

import pytest

from benchmarks import results, scale
from benchmarks.campaign import TimedStage
from tests.support.repository import REPOSITORY
from tests.support.scripts import script


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
    """After a measurement: `python docs/publish/publish.py --documents --only "benchmarks scale"`."""
    page = (REPOSITORY / "docs" / "scaling.md").read_text(encoding="utf-8")
    shown = script("publish/output_blocks.py").blocks_in(page)["python -m benchmarks scale"]
    assert shown == scale.scale_text(results.read(results.RESULTS)).strip()
