"""Words that agree with a number."""

from __future__ import annotations

from harness.wording import counted


def test_counted__has_an_s_unless_the_number_is_1() -> None:
    assert [counted(number, "game") for number in (0, 1, 2)] == ["0 games", "1 game", "2 games"]
