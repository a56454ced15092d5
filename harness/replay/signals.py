"""The traffic lights of a recorded game, as programmes that SUMO plays in place of the net's own.

A light's programme has a phase for each time in which its recorded state did not change. SUMO uses the programme of a
light that was loaded last, and additional files are loaded after the net. Lights off the players' routes are not
recorded: they keep the net's programme.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from xml.etree import ElementTree

import numpy as np
import pandas as pd

PROGRAMME = "recorded"
_AFTER_THE_GAME_S = 3600.0
"""Added to the last phase: the programme must not start again before the replay ends."""


def programmes(trace: pd.DataFrame, step_length_s: float) -> list[ElementTree.Element]:
    """A `<tlLogic>` for each light of a game's trace, in the order of their ids; none for a trace without lights.

    The column `signals` has the state of each light in each step, as `id=state` separated by spaces. A change in a
    step is shown in SUMO's step of the same sample, which is a step later than in the game.
    """
    changes = changes_of_signals(trace, step_length_s)
    return [_programme(light, states, step_length_s) for light, states in changes.items()]


def changes_of_signals(trace: pd.DataFrame, step_length_s: float) -> dict[str, list[tuple[int, str]]]:
    """The steps in which each light's recorded state changed, with the new states; the first is its first state.

    In the order of the lights' ids; empty for a trace without lights.
    """
    if "signals" not in trace:
        return {}
    steps = trace.assign(step=np.rint(trace["time_s"].to_numpy(float) / step_length_s).astype(int))
    steps = steps.drop_duplicates("step").sort_values("step")
    states: dict[str, list[tuple[int, str]]] = {}
    for step, text in zip(steps["step"].tolist(), steps["signals"].tolist(), strict=True):
        for light, state in _states(str(text)):
            states.setdefault(light, []).append((step, state))
    return {
        light: [next(phase) for _, phase in groupby(of_light, key=lambda each: each[1])]
        for light, of_light in sorted(states.items())
    }


def _states(text: str) -> Iterator[tuple[str, str]]:
    """Id and state of each light in a cell of the trace."""
    for each in text.split():
        light, separator, state = each.rpartition("=")  # an id may contain '='
        if separator:
            yield light, state


def _programme(light: str, starts: list[tuple[int, str]], step_length_s: float) -> ElementTree.Element:
    root = ElementTree.Element("tlLogic", id=light, type="static", programID=PROGRAMME, offset="0")
    begin = 0.0  # of SUMO's clock: the first phase also covers the step before the game
    for place, (_, state) in enumerate(starts):
        end = (starts[place + 1][0] + 1) * step_length_s if place + 1 < len(starts) else begin + _AFTER_THE_GAME_S
        ElementTree.SubElement(root, "phase", duration=f"{end - begin:.3f}", state=state)
        begin = end
    return root
