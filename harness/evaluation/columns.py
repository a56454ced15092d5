"""The registry of columns: every table of a run, with what each of its columns is. Metrics are entered beside their
functions (`metrics.metric`); `docs/columns.md` and the headings of pages are made of this."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from harness.evaluation.column import (
    ARM,
    COUNT,
    EPISODES,
    EXACT,
    FLAG,
    MAYBE,
    NUMBER,
    OF_METRIC,
    P_VALUE,
    POINTS,
    SEED,
    SHARE,
    TEXT,
    Column,
    rate,
)
from harness.evaluation.league_columns import LEAGUE_TABLES
from harness.evaluation.measured_game import METRICS_OF_CONDUCT, METRICS_OF_GAMES, METRICS_OF_PLAYERS
from harness.evaluation.result_columns import (
    ATTRIBUTION,
    EQUILIBRIA,
    FALSIFICATION,
    OVER_TRAININGS,
    PERCEPTION,
    PREVENTABILITY,
    REFERENCE_DRIVERS,
    SEARCHES,
    SELECTIONS,
    SHIELDS,
    TAKEOVERS,
    UNDECIDED,
)
from harness.evaluation.severity.closeness import CRITERIA

_T = "95 % t interval"
_PAPER = "the paper, section 4.2"
_ERROR_FREE_ARM = Column("error_free_arm", TEXT, "The same without the perception errors.")
_SHIELDED_ARM = replace(ARM, name="shielded_arm", meaning="The same with the shield.")
PERSONA = Column("persona", TEXT, "The persona of the non-ego; of an arm with one.")
EPISODE = Column("episode", COUNT, "The game. Equal numbers begin alike in every arm and for every training seed.")
_GAME = (ARM, PERSONA, SEED, EPISODE)
_EGO_FAILED = Column("ego_failed", MAYBE, "1 if the ego did not reach its goal, else 0.", source="the paper, section 4")
_ERROR = Column("error", TEXT, "Why the game could not be played; empty if it was.")
_WEATHER = (
    Column("friction", NUMBER, "Coefficient of friction of the road, of a scene that varies it.", optional=True),
    Column("visibility_m", NUMBER, "Distance up to which players see, of a scene that varies it.", optional=True),
)
_PLAYER = Column("player", TEXT, "`ego`, `non_ego`, `non_ego_2` and so on.")
_PAIRS = (
    Column("pairs", COUNT, "Games of both arms that are compared, with the same start."),
    Column("pairs_left_out", COUNT, "Pairs with a game that errored, is missing or has an empty value."),
)
_P = Column("p_value", NUMBER, "Of the paired one-tailed t-test.", unit=P_VALUE, label="p", source=_PAPER)
_P_SHARES = replace(_P, meaning=f"{_P.meaning} Where shares differ alike in all pairs: of McNemar's exact test.")
_P_HOLM = Column(
    "p_holm", NUMBER, "Corrected for all rows of the table.", unit=P_VALUE, label="p after Holm", source="Holm 1979"
)
_P_LOG_RANK = replace(_P, meaning="Of the log-rank test, two-sided.", source="Mantel 1966")
_P_PLANNED = replace(_P_HOLM, meaning="Corrected for all planned tests; of harm for those of harm; else empty.")
_PLANNED = Column("planned_tests", MAYBE, "The tests that the correction is over; empty: the test is secondary.")
_ABOUT = Column("about", TEXT, "What the verdict holds for: `this trained pair`, or `trainings like this`.")
_QUESTION = Column("question", TEXT, "RQ1: does the persona cause failures; RQ2: does retraining reduce them.")
_REASON = Column("reason", TEXT, "Why the question is not answered; else empty.")
_VERDICT = Column("verdict", TEXT, "What the row says about its question.")
_FAILED = "Share of the games in which the ego failed."
_FAILURE_RATE = Column("failure_rate", NUMBER, _FAILED, unit=SHARE)
_GREATER = "the greater of ego_delta_v_mps and other_delta_v_mps."


def _outcome(role: str, who: str) -> Column:
    kinds = "`goal`, `collision` (with a road user), `rail` (with the edge of the drivable area), `timeout` or `error`"
    return Column(f"{role}_outcome", TEXT, f"How the {who}'s game ended: {kinds}; empty without one.")


def _of_player(role: str, whose: str) -> Iterator[Column]:
    for each in METRICS_OF_PLAYERS:
        if whose in each.whose:
            yield replace(each.column, name=f"{role}_{each.column.name}")


def _means(whose: str) -> Iterator[Column]:
    for each in METRICS_OF_PLAYERS:
        if each.mean and whose in each.whose:
            name = each.mean if whose == "ego" else f"non_ego_{each.column.name}"
            yield replace(each.column, name=name, meaning=f"Mean over the games: {each.column.meaning}")


def _summary() -> Iterator[Column]:
    yield from (ARM, PERSONA, SEED, EPISODES)
    yield Column("errors", COUNT, "Games that could not be played.")
    yield from rate("failure_rate", _FAILED)
    for outcome in ("collision", "rail", "timeout"):
        yield Column(f"{outcome}s", MAYBE, f"Games in which the ego's outcome is {outcome}.")
    for each in _means("ego"):
        yield each
        if each.name == "mean_speed_mps":
            for end in ("low", "high"):
                yield Column(f"mean_speed_{end}_mps", NUMBER, f"The {end} end of the {_T} of mean_speed_mps.")
    interval = f"{EXACT} (empty with several people)"
    yield from rate("non_ego_goal_rate", "Share of the people that reached their goals.", interval)
    yield from _means("person")
    yield from rate("near_miss_rate", "Share of the games with a near miss, by any criterion.")
    for criterion in CRITERIA:
        meaning = f"Near misses by a {criterion.bound}. A game can meet several criteria."
        yield Column(f"near_misses_by_{criterion.name}", MAYBE, meaning)
    yield Column("person_failures", MAYBE, "Games with person_failed: a person fails in a contact without the ego.")
    yield Column("bystander_failures", MAYBE, "Games with bystander_failed: background traffic does.")
    yield from rate("harm_to_others_rate", "Share of the games with harm_to_others: a person or a bystander does.")
    meaning = "Mean over the games of the strongest braking of the vehicle that follows the ego; empty without one."
    yield Column("follower_max_deceleration_mps2", NUMBER, meaning)
    meaning = "Mean over the collisions of the closing speed with the road user that the ego touched."
    yield Column("closing_speed_mps", NUMBER, meaning)
    yield Column("delta_v_mps", NUMBER, f"Mean over the collisions of {_GREATER}")
    yield Column("max_delta_v_mps", NUMBER, f"The greatest value over the collisions of {_GREATER}")
    for end, bound in (("low", "lower"), ("high", "upper")):
        meaning = f"Mean of mais3_risk_{end} over the collisions in which it is known: the {bound} bound of the "
        meaning += "probability that a collision injures somebody seriously (MAIS3+)."
        yield Column(f"mais3_risk_{end}", NUMBER, meaning, unit=SHARE)


_STRATEGIES = (Column("ego", TEXT, "The strategy of the ego."), Column("non_ego", TEXT, "That of the non-ego."))


_TABLES = {
    "episodes": (
        *(*_GAME, _outcome("ego", "ego"), _EGO_FAILED, *_of_player("ego", "ego")),
        *(_outcome("non_ego", "person"), *_of_player("non_ego", "person")),
        Column("duration_s", NUMBER, "Duration of the game."),
        *(each.column for each in METRICS_OF_GAMES),
        *_WEATHER,
        _ERROR,
    ),
    "played": (*_GAME, _outcome("ego", "ego"), _outcome("non_ego", "person"), *_WEATHER, _ERROR),
    "causes": (
        *_GAME,
        _outcome("ego", "ego"),
        Column("other", TEXT, "The road user that was involved; empty if none was."),
        Column("event", TEXT, "What led to the failure, by its name in docs/manoeuvres.md."),
        Column("deed", TEXT, "The same in words."),
        Column("time_s", NUMBER, "When that began."),
        Column("time_left_s", NUMBER, "From then to the end of the ego's game: what the ego had."),
        Column("ego_saw", TEXT, "`yes` or `no`; empty if no other was involved."),
        Column(
            "hidden_until_s", NUMBER, "Time before the end at which the other came into sight, if something hid it."
        ),
        Column("reaction", TEXT, "`brakes`, `swerves`, `brakes and swerves` or `no reaction`."),
        Column("braking_mps2", NUMBER, "Strongest braking of the ego in that time."),
        Column("ego_broke", TEXT, "A rule of the road that the ego broke; empty if none."),
    ),
    "manoeuvres": (
        *_GAME,
        _PLAYER,
        Column("manoeuvre", TEXT, "Its name in docs/manoeuvres.md."),
        Column("time_s", NUMBER, "When it begins."),
        Column("until_s", NUMBER, "When it ends."),
        Column("gap_m", NUMBER, "Gap to the leader; of a body that enters a lane, to the follower."),
        Column("ttc_s", NUMBER, "Time to collision, of the same two."),
        Column("text", TEXT, "What it was, in words."),
    ),
    "conduct": (
        *_GAME,
        _PLAYER,
        Column("outcome", TEXT, "How the player's game ended; empty if the ego's game ended before."),
        *(each.column for each in METRICS_OF_CONDUCT),
    ),
    "realism": (
        Column("player", TEXT, "The ego or the persona."),
        SEED,
        Column(
            "figure",
            TEXT,
            "A column of `conduct.csv`, a share of its games, `crashes_per_million_km`, or `crash_odds_ratio`: alone, "
            "against the same person without lapses of attention.",
        ),
        Column("games", COUNT, "Games in which it could be measured."),
        Column("measured_in", TEXT, "`alone on the road`, or `all` games."),
        Column("value", NUMBER, "The median over the games, their share, the rate or the odds ratio.", unit=OF_METRIC),
        Column("low", NUMBER, "5 % quantile; of rate and odds ratio, 95 % low; of a share empty.", unit=OF_METRIC),
        Column("high", NUMBER, "95 % quantile; of rate and odds ratio, 95 % high; of a share empty.", unit=OF_METRIC),
        Column("people_low", NUMBER, "The low end of the range of people; empty: none.", unit=OF_METRIC),
        Column("people_high", NUMBER, "The high end of the range of people; empty: none.", unit=OF_METRIC),
        Column(
            "realistic",
            TEXT,
            "`inside`, `outside`, `outside, declared` or `not comparable`: the value, and of rate and odds ratio their "
            "interval.",
        ),
        Column("reason", TEXT, "Why it is not comparable, or the reason that the persona declares; else empty."),
        Column("source", TEXT, "Where the range of people comes from."),
    ),
    "summary": tuple(_summary()),
    "comparisons": (
        *(_QUESTION, PERSONA, SEED),
        Column(
            "metric",
            TEXT,
            "`failure` or `mean_speed`; of RQ2 also harm to others: `person_failure`, `bystander_failure` and "
            "`follower_braking`, whose H1 is that it grows.",
        ),
        *_PAIRS,
        Column(
            "mean_difference",
            NUMBER,
            "Of the pairs; above 0 supports H1.",
            unit=OF_METRIC,
            label="mean difference towards H1",
        ),
        Column("ci_low", NUMBER, f"The low end of its {_T}.", unit=OF_METRIC, label="its 95 % low"),
        Column("ci_high", NUMBER, f"The high end of its {_T}.", unit=OF_METRIC, label="its 95 % high"),
        Column("t", NUMBER, "The t statistic; empty where all differences are equal.", source=_PAPER),
        *(_P_SHARES, _P_PLANNED, _PLANNED),
        Column("effect_size", NUMBER, "Cohen's d_z: mean over standard deviation.", label="effect size d_z"),
        Column("mcnemar_p", NUMBER, "McNemar's exact test, of shares.", unit=P_VALUE, label="McNemar p"),
        Column("rejects_h0", FLAG, "Whether p_value is below the significance.", label="rejects H0 (p alone)"),
        *(_VERDICT, _ABOUT, _REASON),
    ),
    "over_trainings": (
        *(_QUESTION, PERSONA),
        *OVER_TRAININGS,
        replace(_P, meaning="Of the one-tailed t-test over trainings and starts.", source=""),
        *(_P_PLANNED, _PLANNED, _VERDICT, _ABOUT, _REASON),
    ),
    "attribution": (PERSONA, SEED, *ATTRIBUTION, _REASON),
    "undecided": (ARM, PERSONA, SEED, *UNDECIDED),
    "training": (
        Column("stage", TEXT, "The name of the training."),
        *(PERSONA, SEED),
        Column("steps", COUNT, "Steps played so far."),
        Column("mean_payoff", NUMBER, "Mean payoff of a game since the row before."),
        _FAILURE_RATE,
        Column("games", COUNT, "Games that ended since the row before."),
        Column("mean_duration_s", NUMBER, "Their mean duration."),
        Column(
            "mean_regret",
            NUMBER,
            "Mean of max(0, best payoff of the reference drivers and the naive ego - the ego's latest payoff) over the "
            'preventable starts replayed so far; of trainings with `retraining.starts = "regret"`.',
            unit="payoff",
            source="rounds.md",
            optional=True,
        ),
        Column("stopped", TEXT, "In the last row of a training: `converged`, `budget` or `did not learn`."),
    ),
    "selections": (PERSONA, SEED, *SELECTIONS),
    "shields": (ARM, _SHIELDED_ARM, PERSONA, SEED, *_PAIRS, *SHIELDS),
    "perception": (ARM, _ERROR_FREE_ARM, PERSONA, SEED, *_PAIRS, *PERCEPTION),
    "populations": (
        ARM,
        Column("population", TEXT, "The population that drove against the ego."),
        *(SEED, PERSONA, EPISODES),
        Column("errors", COUNT, "Games that could not be played."),
        *rate("failure_rate", _FAILED),
        *(each for each in _means("ego") if each.name in ("mean_speed_mps", "ego_payoff")),
        *(each for each in _means("person") if each.name == "non_ego_payoff"),
    ),
    "reconfiguration": (
        Column("stage", TEXT, "The name of the search."),
        *(PERSONA, SEED),
        Column("trial", COUNT, "The trial; 0 is the ego as given."),
        Column("parameter", TEXT, "A parameter of the ego."),
        Column("value", NUMBER, "Its value in the trial."),
        Column("low", NUMBER, "The lower bound of the search."),
        Column("high", NUMBER, "The upper bound of the search."),
        Column("mean_payoff", NUMBER, "Mean payoff of the trial's games."),
        _FAILURE_RATE,
        Column("best_payoff", NUMBER, "The best mean payoff so far."),
        Column("chosen", FLAG, "Whether this trial was taken."),
        Column("error", TEXT, "Why the trial could not be played; else empty."),
    ),
    "gaps": (
        *(SEED, PERSONA),
        Column("round", COUNT, "The round of the iterated best response."),
        Column("role", TEXT, "The player replaced by a best response: `ego` or `non_ego`."),
        *_STRATEGIES,
        *_PAIRS,
        Column("payoff", NUMBER, "Mean payoff of the player of that role, over the pairs."),
        Column("payoff_best_response", NUMBER, "That of its best known response."),
        Column(
            "best_known",
            TEXT,
            "That response: `its own strategy`, `the search`, or another strategy or arm; two are joined by ` + `.",
        ),
        Column("known", COUNT, "Other strategies of the player that were compared beside its own and the search."),
        Column("gap", NUMBER, "Mean of best known response minus player; 0 or below: nothing better is known."),
        Column("ci_low", NUMBER, f"The low end of its {_T}.", label="its 95 % low"),
        Column("ci_high", NUMBER, f"The high end of its {_T}.", label="its 95 % high"),
        Column("gap_share", NUMBER, "gap / |payoff|; empty where the payoff is 0.", unit=SHARE),
        Column("search_steps", COUNT, "The budget of each training of the search."),
        Column("search_starts", COUNT, "The trainings of the search."),
        *Column("search_gap", NUMBER, "The gap of the search alone.").with_interval(_T),
        *(_P, _P_HOLM),
        *rate("ego_failure_rate", "Of the ego in the pair."),
        *rate("ego_failure_rate_best_response", "The same with the best known response in place of the player."),
        *Column(
            "failure_difference", NUMBER, "Mean of ego failures with the best response minus without.", unit=POINTS
        ).with_interval(_T),
        *(_VERDICT, _REASON),
    ),
    "crossplay": (
        *(SEED, *_STRATEGIES, PERSONA, ARM),
        Column("games", COUNT, "Games that were played and measured."),
        Column("left_out", COUNT, "Episodes of this seed that were not played, not measured, or are missing."),
        *rate("failure_rate", _FAILED),
        *Column("ego_payoff", NUMBER, "Mean payoff of the ego.").with_interval(_T),
        *Column("non_ego_payoff", NUMBER, "Mean payoff of the non-ego.").with_interval(_T),
        Column("ego_mean_speed_mps", NUMBER, "Mean over the games of the ego's mean speed."),
    ),
    "equilibria": (SEED, *EQUILIBRIA),
    "generalisation": (
        SEED,
        Column("ego", TEXT, "The retrained ego."),
        Column("met", TEXT, "The personas it was trained against, joined by ` + `."),
        Column("persona", TEXT, "Of the non-ego: one it was not trained against."),
        Column("non_ego", TEXT, "The non-ego."),
        *_PAIRS,
        *rate("failure_rate", _FAILED),
        Column("naive_failure_rate", NUMBER, "Of the naive ego against the same non-ego, same episodes.", unit=SHARE),
        Column("share_of_naive", NUMBER, "failure_rate / naive_failure_rate; empty where the naive ego never fails."),
        *Column(
            "fewer_failures", NUMBER, "Mean of naive minus this ego; above 0 it fails less.", unit=POINTS
        ).with_interval(_T),
        *(_P_SHARES, _P_HOLM, _VERDICT, _REASON),
    ),
    "searches": SEARCHES,
    "falsification": (*FALSIFICATION, _P_LOG_RANK, _P_HOLM, _VERDICT),
    "reference_drivers": (*_GAME, _outcome("ego", "ego"), *REFERENCE_DRIVERS),
    "takeovers": (ARM, SEED, EPISODE, *TAKEOVERS),
    "preventability": (ARM, PERSONA, SEED, *PREVENTABILITY),
    **LEAGUE_TABLES,
}
TABLES: Mapping[str, Mapping[str, Column]] = {
    table: {column.name: column for column in columns} for table, columns in _TABLES.items()
}
"""Each table by the name of its file; `played` is what a stage stores of the games that it plays."""

MEANS = {each.column.name: each for each in METRICS_OF_PLAYERS if each.mean}
"""The metrics of players whose means per arm are columns of `summary.csv`."""
