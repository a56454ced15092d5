"""The columns of the table `equilibria`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import MAYBE, NUMBER, SHARE, TEXT, Column

EQUILIBRIA = (
    Column("game", TEXT, "The persona of the non-egos, or `all`: every non-ego, of any persona or none."),
    Column("solution", TEXT, "`nash`, `safest` (game `all` only), or why there is none."),
    Column("number", MAYBE, "Of the equilibrium within seed and game, from 1, the one to choose first."),
    Column("role", TEXT, "`ego` or `non_ego`."),
    Column("player", TEXT, "The strategy."),
    Column("share", NUMBER, "How often its role plays it; empty for the non-egos of `safest`.", unit=SHARE),
    Column("payoff", NUMBER, "Of this strategy against the other side's shares (nash)."),
    Column("solution_payoff", NUMBER, "Of its role in this solution (nash)."),
    Column("regret", NUMBER, "The possible gain of its role by another strategy of the table (nash)."),
    Column("failure_rate", NUMBER, "Of the ego against the other side's shares; safest: its worst case.", unit=SHARE),
    Column("solution_failure_rate", NUMBER, "Of the ego in this solution; safest: the mixture's worst.", unit=SHARE),
    Column(
        "held_out_failure_rate",
        NUMBER,
        "The same by 10-fold cross-validation over the episodes (nash: number 1 only).",
        unit=SHARE,
    ),
    Column("dominated_in_payoff", TEXT, "The strategy or mixture of its role that strictly dominates it; empty: none."),
    Column("dominated_in_failures", TEXT, "The same for an ego's failure rates."),
)
