"""The columns of the table `over_trainings`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import COUNT, MAYBE, NUMBER, POINTS, Column

_CROSSED = "95 % interval over trainings and starts (a two-level bootstrap)"
OVER_TRAININGS = (
    Column("trainings", COUNT, "The trainings that are compared: those whose question is answered."),
    Column("trainings_left_out", COUNT, "The others of the campaign."),
    Column("starts", MAYBE, "Starts that all of these trainings play in both arms."),
    Column("starts_left_out", MAYBE, "Starts of which a training has no pair: errored, missing or not measured."),
    Column(
        "mean_difference",
        NUMBER,
        "Of failures, over trainings and starts; above 0 supports H1.",
        unit=POINTS,
        label="mean difference towards H1",
    ),
    Column("ci_low", NUMBER, f"The low end of its {_CROSSED}.", unit=POINTS, label="its 95 % low"),
    Column("ci_high", NUMBER, f"The high end of its {_CROSSED}.", unit=POINTS, label="its 95 % high"),
    Column("least", NUMBER, "The mean difference of the training with the least.", unit=POINTS),
    Column("most", NUMBER, "That of the training with the most.", unit=POINTS),
    Column("standard_error", NUMBER, "Of mean_difference, by a two-level bootstrap.", unit=POINTS, source="Owen 2007"),
    Column("degrees", NUMBER, "Degrees of freedom of t.", source="Satterthwaite 1946"),
    Column("t", NUMBER, "mean_difference / standard_error; empty where all differences are equal."),
)
