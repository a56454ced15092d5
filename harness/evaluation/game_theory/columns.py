"""The columns of the tables of findings, in order, each with its pandas dtype. Shares and rates are from 0 to 1."""

from __future__ import annotations

GAP_COLUMNS = {
    "seed": "int64",
    "persona": "object",
    "round": "int64",
    "role": "object",  # the player replaced by a best response: ego or non_ego
    "ego": "object",
    "non_ego": "object",
    "pairs": "int64",
    "pairs_left_out": "int64",
    "payoff": "float64",  # the mean of the player of that role, over the pairs
    "payoff_best_response": "float64",
    "gap": "float64",  # mean of best response - player, over the pairs; below 0: the training found nothing better
    "ci_low": "float64",  # 95 % t interval of the gap
    "ci_high": "float64",
    "gap_share": "float64",  # gap / |payoff|; empty where the payoff is 0
    "p_value": "float64",  # paired t-test, one-tailed: the gap is > 0
    "p_holm": "float64",  # over all gaps of the table
    "ego_failure_rate": "float64",  # of the ego in the pair
    "ego_failure_rate_low": "float64",  # 95 % Clopper-Pearson interval
    "ego_failure_rate_high": "float64",
    "ego_failure_rate_best_response": "float64",  # where role is non_ego: induced by a best-responding persona
    "ego_failure_rate_best_response_low": "float64",
    "ego_failure_rate_best_response_high": "float64",
    "failure_difference": "float64",  # mean of ego failures with the best response - without, over the pairs
    "failure_difference_low": "float64",  # 95 % t interval
    "failure_difference_high": "float64",
    "verdict": "object",  # harness.evaluation.game_theory.best_response_gap.GapVerdict
    "reason": "object",  # why there is no verdict for want of competence; else empty
}
"""Columns of `gaps.csv`: a row for each best response."""

CROSSPLAY_COLUMNS = {
    "seed": "int64",
    "ego": "object",
    "non_ego": "object",
    "persona": "object",
    "arm": "object",
    "games": "int64",  # played and measured
    "left_out": "int64",  # of the episodes of this seed: not played, not measured, or missing
    "failure_rate": "float64",
    "failure_rate_low": "float64",  # 95 % Clopper-Pearson interval
    "failure_rate_high": "float64",
    "ego_payoff": "float64",
    "ego_payoff_low": "float64",  # 95 % t interval
    "ego_payoff_high": "float64",
    "non_ego_payoff": "float64",
    "non_ego_payoff_low": "float64",
    "non_ego_payoff_high": "float64",
    "ego_mean_speed_mps": "float64",
}
"""Columns of `crossplay.csv`: a row for each pairing."""

EQUILIBRIUM_COLUMNS = {
    "seed": "int64",
    "game": "object",  # the persona of the non-egos, or "all": every non-ego, of any persona or none
    "solution": "object",  # "nash", "safest" (game "all" only), or why there is none
    "number": "Int64",  # of the equilibrium within seed and game, from 1, the one to choose first
    "role": "object",
    "player": "object",  # the strategy
    "share": "float64",  # how often its role plays it in this solution; empty for the non-egos of "safest"
    "payoff": "float64",  # of this strategy against the other side's shares (nash)
    "solution_payoff": "float64",  # of its role in this solution (nash)
    "regret": "float64",  # the possible gain of its role by another strategy of the table (nash)
    "failure_rate": "float64",  # of the ego: this strategy against the other side's shares; safest: its worst case
    "solution_failure_rate": "float64",  # of the ego in this solution; safest: the mixture's worst case
    "dominated_in_payoff": "object",  # the strategy or mixture of its role that strictly dominates it; empty: none
    "dominated_in_failures": "object",  # the same for an ego's failure rates
}
"""Columns of `equilibria.csv`: a row for each strategy of each solution of each game."""

GENERALISATION_COLUMNS = {
    "seed": "int64",
    "ego": "object",
    "met": "object",  # the personas it was trained against, joined by " + "
    "persona": "object",  # of the non-ego: one it was not trained against
    "non_ego": "object",
    "pairs": "int64",
    "pairs_left_out": "int64",
    "failure_rate": "float64",  # of this ego against this non-ego, over the pairs
    "failure_rate_low": "float64",  # 95 % Clopper-Pearson interval
    "failure_rate_high": "float64",
    "naive_failure_rate": "float64",  # of the naive ego against the same non-ego, over the same episodes
    "share_of_naive": "float64",  # failure_rate / naive_failure_rate; empty where the naive ego never fails
    "fewer_failures": "float64",  # mean of naive - this ego, over the pairs: above 0 it fails less
    "fewer_failures_low": "float64",  # 95 % t interval
    "fewer_failures_high": "float64",
    "p_value": "float64",  # paired t-test, one-tailed: it fails less than the naive ego
    "p_holm": "float64",  # over the table
    "verdict": "object",  # harness.evaluation.research_questions.Verdict
    "reason": "object",  # why there is no verdict for want of competence; else empty
}
"""Columns of `generalisation.csv`: a row for each retrained ego and non-ego of a persona it was not trained against."""

GAME_TABLES = {
    "gaps": GAP_COLUMNS,
    "crossplay": CROSSPLAY_COLUMNS,
    "equilibria": EQUILIBRIUM_COLUMNS,
    "generalisation": GENERALISATION_COLUMNS,
}
