"""What all environments with a running SUMO simulation have in common."""

from __future__ import annotations

from typing import Any, NoReturn


class LiveSimulation:
    """An environment that holds a running SUMO simulation, which is neither pickled nor copied."""

    def __reduce_ex__(self, protocol: Any) -> NoReturn:
        """Raises TypeError: `pickle`, `copy` and `cloudpickle` ask for this."""
        raise TypeError(
            f"{type(self).__name__} holds a running SUMO simulation and can't be pickled or copied: pass on a function "
            "that makes it, such as lambda: gymnasium.make('harness:harness/Ego-v0'), and call that where it is needed"
        )
