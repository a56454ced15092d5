"""The rule book: one set of rules names the manoeuvres of a game and the cause of a failure."""
