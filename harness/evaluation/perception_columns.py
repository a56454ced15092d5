"""The columns of the table `perception`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import NUMBER, P_VALUE, POINTS, SHARE, Column, rate

PERCEPTION = (
    *rate("failure_rate", "Share of the pairs in which the ego fails with its perception errors."),
    *rate("error_free_failure_rate", "The same without them."),
    *Column("more_failures", NUMBER, "Mean of with minus without the errors.", unit=POINTS).with_interval(
        "95 % t interval"
    ),
    Column("mcnemar_p", NUMBER, "McNemar's exact test of these failures, two-sided.", unit=P_VALUE, label="McNemar p"),
    Column(
        "p_holm", NUMBER, "mcnemar_p, corrected for all rows.", unit=P_VALUE, label="p after Holm", source="Holm 1979"
    ),
    *Column("speed_loss_mps", NUMBER, "Mean speed of the ego without minus with them.", unit="m/s").with_interval(
        "95 % t interval"
    ),
    Column("lost_share", NUMBER, "Mean over the games with them: the share of steps with a loss.", unit=SHARE),
    Column("ghost_share", NUMBER, "Mean over the games with them: the share of steps with a ghost.", unit=SHARE),
)
