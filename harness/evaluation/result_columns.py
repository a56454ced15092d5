"""The columns of tables that are made of games, but for those that many tables share: `columns.TABLES` joins them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from harness.evaluation.column import COUNT, FLAG, MAYBE, NUMBER, P_VALUE, POINTS, SEED, SHARE, TEXT, Column, rate

_T = "95 % t interval"
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

_MCNEMAR = Column("p", NUMBER, "McNemar's exact test of these pairs, two-sided.", unit=P_VALUE, label="p")
_MCNEMAR_OF_FAILURES = Column(
    "mcnemar_p", NUMBER, "McNemar's exact test of these failures, two-sided.", unit=P_VALUE, label="McNemar p"
)
_HOLM = Column("p_holm", NUMBER, "Corrected for all tests of the table.", unit=P_VALUE, source="Holm 1979")


def _compared(name: str, counts: tuple[Column, Column], meaning: str) -> Iterator[Column]:
    yield Column(f"{name}_pairs", MAYBE, "Games of both arms that are compared, with the same start.")
    yield Column(f"{name}_pairs_left_out", MAYBE, "Pairs with a game that errored or is missing.")
    yield from counts
    yield from Column(f"{name}_difference", NUMBER, meaning, unit=POINTS).with_interval(_T)
    for column, label in ((_MCNEMAR, "p"), (_HOLM, "p after Holm")):
        yield replace(column, name=f"{name}_{column.name}", label=label)


ATTRIBUTION = (
    Column("trait", TEXT, "A trait in which the persona differs from the baseline, or `all` of them."),
    Column("arm", TEXT, "The ego against the persona."),
    Column("without_arm", TEXT, "Against the persona with the baseline's value of the trait; of `all`: the baseline."),
    *_compared(
        "without",
        (
            Column("failures", MAYBE, "Failures of the ego against the persona, in these pairs."),
            Column("failures_without", MAYBE, "Those against the persona without the trait."),
        ),
        "Mean of failures with the trait minus without; above 0 the trait causes failures.",
    ),
    Column("example", MAYBE, "The worst game that the ego fails against the persona and not without the trait."),
    Column("baseline_arm", TEXT, "The ego against the baseline."),
    Column("alone_arm", TEXT, "Against the baseline with the persona's value of the trait; of `all`: empty."),
    *_compared(
        "alone",
        (
            Column("failures_baseline", MAYBE, "Failures of the ego against the baseline, in these pairs."),
            Column("failures_alone", MAYBE, "Those against the baseline with this trait alone."),
        ),
        "Mean of failures of the baseline with the trait minus without; above 0 the trait causes failures by itself.",
    ),
)
_OF_FAILURES = "Of these, those in which the person involved made no decision, because its attention had lapsed,"
UNDECIDED = (
    Column("failures", COUNT, "Failures of the ego."),
    Column("undecided_all_game", COUNT, f"{_OF_FAILURES} from the start to the end of its game."),
    Column("undecided_since_conflict", COUNT, f"{_OF_FAILURES} from the `time_s` of `causes.csv` to the end."),
    Column("undecided_last_second", COUNT, f"{_OF_FAILURES} in the last second of its game."),
)

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

_CRITERION = Column(
    "criterion",
    TEXT,
    "`failure`: the ego fails; else the reference driver that prevents it from the conflict on.",
)
_SEARCHER = Column("searcher", TEXT, "`random`, `cross-entropy` or `cma-es`.")
_GAMES = Column("games", COUNT, "Games of each search.")
SEARCHES = (
    Column("arm", TEXT, "The arm whose players play."),
    *(SEED, _SEARCHER),
    Column("learned", FLAG, "Whether learned people play, from random starts; else SUMO drives for the people."),
    Column("repeat", COUNT, "The search, of several with other random numbers."),
    *(_CRITERION, _GAMES),
    Column("found", COUNT, "Games that meet the criterion."),
    Column("first_game", MAYBE, "The first of them, from 1; empty: none."),
)
FALSIFICATION = (
    _CRITERION,
    Column("arm", TEXT, "The arm of learned people."),
    SEED,
    Column("searched_arm", TEXT, "The arm whose starts and ordinary drivers were searched."),
    *(_SEARCHER,),
    Column("repeats", COUNT, "Searches on each side."),
    _GAMES,
    Column("found_by_person", COUNT, "Searches with learned people in which a game met the criterion."),
    Column("found_by_searcher", COUNT, "Searches of the searcher in which a game met the criterion."),
    Column("mean_games_person", NUMBER, "Mean games with learned people until the first find, at most `games`."),
    Column("mean_games_searcher", NUMBER, "The same of the searcher."),
)

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

SELECTIONS = (
    Column("round", COUNT, "The round of the iterated best response."),
    Column("role", TEXT, "The player that goes on: `ego` or `non_ego`."),
    Column("strategy", TEXT, "Its strategy of this round, which is the chosen candidate."),
    Column("candidate", TEXT, "A policy of the player, named after its training; the last one is the new answer."),
    Column("episodes", COUNT, "Games of the selection that every candidate played, all with the same starts."),
    Column("alone", COUNT, "Those of them without the opponent."),
    Column("left_out", COUNT, "Games that a candidate could not play: they count for none."),
    *Column("payoff", NUMBER, "Mean payoff of the candidate.").with_interval(_T),
    *Column("more_than_answer", NUMBER, "Mean of its payoff minus the new answer's in the same games.").with_interval(
        _T
    ),
    Column("failure_rate", NUMBER, "Share of these games in which it did not reach its goal.", unit=SHARE),
    Column("chosen", FLAG, "Whether the player goes on with it."),
)

SHIELDS = (
    *rate("failure_rate", "Share of the pairs in which the ego fails without the shield."),
    *rate("shielded_failure_rate", "The same with the shield."),
    *Column("fewer_failures", NUMBER, "Mean of without minus with the shield.", unit=POINTS).with_interval(_T),
    _MCNEMAR_OF_FAILURES,
    *Column("speed_loss_mps", NUMBER, "Mean speed of the ego without minus with it.", unit="m/s").with_interval(_T),
    Column("shield_interventions_per_km", NUMBER, "Mean over the games with it.", unit="1/km"),
    Column("shielded_share", NUMBER, "Mean over the games with it: the share of steps.", unit=SHARE),
)

PERCEPTION = (
    *rate("failure_rate", "Share of the pairs in which the ego fails with its perception errors."),
    *rate("error_free_failure_rate", "The same without them."),
    *Column("more_failures", NUMBER, "Mean of with minus without the errors.", unit=POINTS).with_interval(_T),
    _MCNEMAR_OF_FAILURES,
    replace(_HOLM, meaning="mcnemar_p, corrected for all rows.", label="p after Holm"),
    *Column("speed_loss_mps", NUMBER, "Mean speed of the ego without minus with them.", unit="m/s").with_interval(_T),
    Column("lost_share", NUMBER, "Mean over the games with them: the share of steps with a loss.", unit=SHARE),
    Column("ghost_share", NUMBER, "Mean over the games with them: the share of steps with a ghost.", unit=SHARE),
)
