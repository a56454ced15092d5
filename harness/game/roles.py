"""The players of a game and their names."""

from __future__ import annotations

from functools import cache

EGO, NON_EGO = 0, 1
ROLES = ("ego", "non_ego")
"""The two kinds of player."""
MOST_PEOPLE = 4
"""Non-egos of a game."""


@cache
def roles_of(players: int) -> tuple[str, ...]:
    """The names of the players [P] of a game in every file: `ego`, `non_ego`, and with more people `non_ego_2`,
    `non_ego_3` and so on."""
    return (*ROLES, *(f"{ROLES[NON_EGO]}_{place}" for place in range(2, players)))


def role_in_words(role: str) -> str:
    """A name of `roles_of`, or one that begins with such a name, in prose.

    >>> role_in_words("non_ego_2")
    'non-ego 2'
    """
    return role.replace("non_ego", "non-ego").replace("_", " ")
