"""The columns of a trace: a row for each road user in each step of a game."""

from __future__ import annotations

from harness.evaluation.column import COUNT, FLAG, NUMBER, TEXT, Column

SHIELDED = Column("shielded", FLAG, "Whether a shield changed the player's decision; in arms with a shield only.")
PERCEIVED = (
    Column(
        "ego_lost",
        TEXT,
        "In the ego's rows: the road users that its object list lacks because they are lost, separated by spaces; in "
        "arms with perception errors only.",
    ),
    Column(
        "ego_ghosts",
        TEXT,
        "In the ego's rows: the ghosts that it sees, separated by `; `, each with x_m, y_m, heading_rad and speed_mps; "
        "in arms with perception errors only.",
    ),
)
_LINKS = "by traffic light and signal link"
TRACE_COLUMNS = (
    Column("episode", COUNT, "The game."),
    Column("step", COUNT, "The step; the start of the game is step 0."),
    Column("time_s", NUMBER, "Time since the start of the game."),
    Column("player", TEXT, "`ego`, `non_ego`, `non_ego_2` and so on, `obstacle_1` and so on, or SUMO's id."),
    Column("vehicle_type", TEXT, "The vehicle type in the scene's route file."),
    Column("x_m", NUMBER, "The centre of the body, in the coordinates of the net."),
    Column("y_m", NUMBER, "As `x_m`."),
    Column("heading_rad", NUMBER, "0 is the direction of x; counter-clockwise.", unit="rad"),
    Column("speed_mps", NUMBER, "Its speed."),
    Column("acceleration_mps2", NUMBER, "A player's acceleration along its heading; of others 0."),
    Column("steering_rad", NUMBER, "The road wheel angle, left positive; known where `steers` is true.", unit="rad"),
    Column("lapsed", FLAG, "Whether the player has a lapse of attention."),
    Column("steers", FLAG, "Whether the harness moves the player, so that its steering is known."),
    Column("station_m", NUMBER, "A player's distance along its route; of others 0."),
    Column("payoff", NUMBER, "A player's own payoff of the step; of others 0."),
    Column("outcome", TEXT, "How the player's game has ended; empty while it runs, and of others."),
    Column("signals", TEXT, f"The states of the signals {_LINKS}, as SUMO writes them; empty without signals."),
    Column("signal_s", TEXT, f"In step 0: the times since they changed, in seconds, {_LINKS}; then empty."),
    Column("friction", NUMBER, "The coefficient of friction of the road in the game."),
    Column("limit_share", NUMBER, "The factor on the speed limits in the game."),
)
