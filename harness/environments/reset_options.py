"""The `options` of `reset`: a certain game instead of the next one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from harness.config.toml_reading import nearest
from harness.errors import UsageError

EPISODE, CAMPAIGN_SEED = "episode", "campaign_seed"


def named_game(options: Mapping[str, Any] | None, others: bool = False) -> tuple[str | int, ...] | None:
    """The parts of the seeds of the game that `options` ask for; None if they ask for none.

    `{"episode": 3}` is episode 3 of every arm of a campaign with the seed 1; `campaign_seed` names another seed. Raises
    UsageError for values that are no whole numbers from 0 on, and for other keys unless `others` are ignored.
    """
    known = (EPISODE, CAMPAIGN_SEED)
    options = {key: value for key, value in (options or {}).items() if key in known or not others}
    if not options:
        return None
    for key, value in options.items():
        if key not in known:
            raise UsageError.of("reset", f"options[{key!r}]", "is no option", nearest(str(key), known))
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise UsageError.of("reset", f"options[{key!r}]", f"is {value!r}", "give a whole number from 0 on")
    if EPISODE not in options:
        raise UsageError.of("reset", "options['episode']", "is missing", "name the episode of the campaign's seed")
    from harness.game.seeding import parts_of  # imports pandas

    return parts_of(options.get(CAMPAIGN_SEED, 1), options[EPISODE])
