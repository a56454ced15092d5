"""The columns of the tables `reference_drivers`, `takeovers` and `preventability`, but those that many tables share."""

from __future__ import annotations

from collections.abc import Iterator

from harness.evaluation.column import COUNT, MAYBE, NUMBER, TEXT, Column, rate

_DRIVER = Column("driver", TEXT, "The reference driver.")


def _prevented(verdict: str) -> Iterator[Column]:
    yield Column(f"{verdict}_judged", COUNT, "Failures with a verdict.")
    yield Column(f"{verdict}_prevented", COUNT, "Of these, prevented.")
    yield from rate(f"{verdict}_share", "prevented / judged.")
    yield from rate(f"{verdict}_rate", "prevented / episodes.")


REFERENCE_DRIVERS = (
    _DRIVER,
    Column("failed_s", NUMBER, "When the ego failed."),
    Column("conflict_s", NUMBER, "The first moment at which the driver's rule says danger; empty: never."),
    Column("prevented_from_conflict", MAYBE, "1: it prevents the collision from then on, 0: not, empty: no verdict."),
    Column("prevented_moving_over", MAYBE, "The same, if the other moves on into the ego's line after the collision."),
    Column("prevented_from_start", MAYBE, "1: driving from the start it reaches the goal, 0: not."),
    Column(
        "outcome_from_start",
        TEXT,
        "How the game ends with this driver from the start; `on_red`, `wrong_way`: a goal that breaks this rule.",
    ),
    Column("preventable_from_s", NUMBER, "First moment from which full braking prevents it, the other moving over."),
    Column("preventable_until_s", NUMBER, "Last moment from which full braking prevents it, the other moving over."),
    Column("error", TEXT, "Why the game could not be played from the start; else empty."),
)
TAKEOVERS = (
    _DRIVER,
    Column(
        "player",
        TEXT,
        "`ego`: as the driver drives it, from the step in which it takes over. A person: as it is taken to go on after "
        "the recorded collision.",
    ),
    Column("step", COUNT, "The step, counted as in the recorded game."),
    Column("x_m", NUMBER, "The centre of the body, in the coordinates of the net."),
    Column("y_m", NUMBER, "As `x_m`."),
    Column("heading_rad", NUMBER, "0 is the direction of x; counter-clockwise.", unit="rad"),
)
"""Of each collision that a reference driver prevents from the conflict on, the courses with the first that does."""
PREVENTABILITY = (
    _DRIVER,
    Column("episodes", COUNT, "Games that were played.", label="games"),
    Column("failures", COUNT, "Failures of the ego."),
    *_prevented("from_conflict"),
    *_prevented("moving_over"),
    *_prevented("from_start"),
)
