"""The columns of the tables of a league."""

from __future__ import annotations

from harness.evaluation.column import ARM, COUNT, EPISODES, MAYBE, NUMBER, SEED, TEXT, Column, rate

NOBODY, SUMO_DRIVER = "nobody", "sumo"
"""The column `person` of arms without a persona."""
UNTRAINED = (NOBODY, SUMO_DRIVER)
_EGO = (
    Column("ego", TEXT, "The ego of the league."),
    Column("shield", TEXT, "The rule of the shield around it (docs/shield.md): `rss`. Empty: it has none."),
)
_PAIRING = (
    *_EGO,
    Column("scene", TEXT, "The scene."),
    Column("person", TEXT, "`nobody`, `sumo` (SUMO's driver in the person's seat), or the persona."),
)
_ENDS = ("collision", "rail", "timeout")
_MEASURES = (
    Column("errors", COUNT, "Games that could not be played."),
    *rate("failure_rate", "Share of the games in which the ego failed."),
    *(Column(f"{each}s", MAYBE, f"Games in which the ego's outcome is {each}.") for each in _ENDS),
    *rate(
        "preventable_rate",
        "Share of the games that the ego fails, and the careful and competent driver of UN R157 does not, from "
        "the start in its place; judged against personas.",
    ),
    Column(
        "serious_injuries",
        NUMBER,
        "Expected number of games with a serious injury (MAIS3+), per game, at most: the sum of mais3_risk_high where "
        "it is known, over the games that were played.",
    ),
    *rate("harm_to_others_rate", "Share of the games with harm_to_others: a person or a bystander fails."),
    Column("mean_speed_mps", NUMBER, "Mean over the games of the ego's average speed."),
    *rate("hard_brake_rate", "Share of the games in which the ego brakes hard (`hard_brake` in docs/manoeuvres.md)."),
    Column(
        "reason",
        TEXT,
        "Why the row says nothing about how the ego copes with people: a player can't drive the scene alone. Empty "
        "where both can, and for `nobody`.",
    ),
)
_GAMES_OF_PAIRING = (
    Column("failed_episodes", TEXT, "The numbers of the games in which the ego failed."),
    Column("unplayed_episodes", TEXT, "The numbers of the games that could not be played."),
    Column(
        "games_sha256",
        TEXT,
        "Of what the games depend on beside the ego: scene, starts, the person's document and policy. Rows with the "
        "same one have the same games.",
    ),
)
_RANKS = (
    Column("rank", COUNT, "1, and the number of egos that fail significantly less often in the same games."),
    *_EGO,
    Column("games", COUNT, "Games that every ego of the table played."),
    Column("games_left_out", COUNT, "Other games of this ego."),
    *rate("failure_rate", "Share of these games in which the ego failed."),
    Column("told_apart", TEXT, "The egos with significantly more or fewer failures, joined by ` + `: McNemar, Holm."),
)

LEAGUE_TABLES = {
    "league_ranks": _RANKS,
    "league_games": (*_PAIRING, SEED, EPISODES, *_GAMES_OF_PAIRING),
    "league": (*_PAIRING, SEED, ARM, EPISODES, *_MEASURES),
}
