"""The columns of the table `shields`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import NUMBER, P_VALUE, POINTS, SHARE, Column, rate

SHIELDS = (
    *rate("failure_rate", "Share of the pairs in which the ego fails without the shield."),
    *rate("shielded_failure_rate", "The same with the shield."),
    *Column("fewer_failures", NUMBER, "Mean of without minus with the shield.", unit=POINTS).with_interval(
        "95 % t interval"
    ),
    Column("mcnemar_p", NUMBER, "McNemar's exact test of these failures, two-sided.", unit=P_VALUE, label="McNemar p"),
    *Column("speed_loss_mps", NUMBER, "Mean speed of the ego without minus with it.", unit="m/s").with_interval(
        "95 % t interval"
    ),
    Column("shield_interventions_per_km", NUMBER, "Mean over the games with it.", unit="1/km"),
    Column("shielded_share", NUMBER, "Mean over the games with it: the share of steps.", unit=SHARE),
)
