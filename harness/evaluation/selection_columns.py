"""The columns of the table `selections`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import COUNT, FLAG, NUMBER, SHARE, TEXT, Column

SELECTIONS = (
    Column("round", COUNT, "The round of the iterated best response."),
    Column("role", TEXT, "The player that goes on: `ego` or `non_ego`."),
    Column("strategy", TEXT, "Its strategy of this round, which is the chosen candidate."),
    Column("candidate", TEXT, "A policy of the player, named after its training; the last one is the new answer."),
    Column("episodes", COUNT, "Games of the selection that every candidate played, all with the same starts."),
    Column("alone", COUNT, "Those of them without the opponent."),
    Column("left_out", COUNT, "Games that a candidate could not play: they count for none."),
    *Column("payoff", NUMBER, "Mean payoff of the candidate.").with_interval("95 % t interval"),
    *Column("more_than_answer", NUMBER, "Mean of its payoff minus the new answer's in the same games.").with_interval(
        "95 % t interval"
    ),
    Column("failure_rate", NUMBER, "Share of these games in which it did not reach its goal.", unit=SHARE),
    Column("chosen", FLAG, "Whether the player goes on with it."),
)
