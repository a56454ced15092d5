"""Which stage is carried out next: after what it needs, seed by seed, the longest chain first, and never for ever."""

from __future__ import annotations

from harness.campaign.execution.schedule import Schedule
from tests.support.plans import training_of as stage


def carried_out(schedule: Schedule) -> list[str]:
    """The order in which one worker carries out a schedule."""
    order = []
    while (next_stage := schedule.take()) is not None:
        order.append(next_stage.id)
        schedule.done(next_stage.id)
    return order


def test_schedule__each_stage_comes_after_those_it_needs() -> None:
    stages = [stage("d", "b", "c"), stage("b", "a"), stage("c", "a"), stage("a")]
    assert carried_out(Schedule(stages, [])) == ["a-seed1", "b-seed1", "c-seed1", "d-seed1"]


def test_schedule__finished_stages_are_neither_taken_nor_waited_for() -> None:
    assert carried_out(Schedule([stage("a"), stage("b", "a")], ["a-seed1"])) == ["b-seed1"]
    assert carried_out(Schedule([stage("a")], ["a-seed1"])) == []


def test_schedule__the_first_seed_comes_first() -> None:
    stages = [each for seed in (7, 1) for each in (stage("a", seed=seed), stage("b", "a", seed=seed))]
    assert carried_out(Schedule(stages, [])) == ["a-seed7", "b-seed7", "a-seed1", "b-seed1"]


def test_schedule__two_workers_begin_with_two_seeds() -> None:
    """The second seed's first stage is ready while the first seed's is carried out; then the first seed goes on."""
    schedule = Schedule([each for seed in (1, 2) for each in (stage("a", seed=seed), stage("b", "a", seed=seed))], [])
    first, second = schedule.take(), schedule.take()
    assert first is not None
    assert second is not None
    assert [first.id, second.id] == ["a-seed1", "a-seed2"]
    schedule.done("a-seed1")
    schedule.done("a-seed2")
    assert carried_out(schedule) == ["b-seed1", "b-seed2"]


def test_schedule__the_longest_chain_comes_first() -> None:
    stages = [stage("short"), stage("a"), stage("b", "a"), stage("c", "b")]
    assert carried_out(Schedule(stages, []))[0] == "a-seed1"


def test_schedule__a_stage_that_is_put_back_is_taken_next() -> None:
    schedule = Schedule([stage("a"), stage("b")], [])
    taken = schedule.take()
    assert taken is not None
    schedule.put_back(taken)
    assert schedule.take() == taken


def test_schedule__what_needs_a_failed_stage_is_skipped_with_the_reason_once() -> None:
    schedule = Schedule([stage("a"), stage("b", "a"), stage("c", "a", "b"), stage("d")], [])
    taken = schedule.take()
    assert taken is not None
    skipped = schedule.fail(taken.id)
    assert skipped == {"b-seed1": ["a-seed1"], "c-seed1": ["a-seed1", "b-seed1"]}
    assert carried_out(schedule) == ["d-seed1"]
