"""Games of an assessment per second of processor time: alone, and side by side in batches."""

from __future__ import annotations

import time
from collections.abc import Sequence

from benchmarks.games import REPOSITORY, coasting_policy, persona
from harness.assessment.rollout import assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver
from harness.drivers.protocol import Driver
from harness.drivers.shield import ShieldedDriver
from harness.drivers.sumo import SumoDriver
from harness.road.scene.open_scene import open_scene

_GAMES = 100
_TURNS = 2
_SCENES = ("paper_merge", "merge", "left_across", "zebra")


def assessment_table() -> str:
    """In Markdown, for some scenes: the games per second of two learned drivers, without and with a shield around the
    ego, and of a learned ego among SUMO's drivers, with traces and without metrics. The better of two turns counts.
    """
    lines = ["| scene | a learned person | the same, the ego with a shield | SUMO |", "| --- | ---: | ---: | ---: |"]
    for name in _SCENES:
        scene = open_scene(REPOSITORY / "networks" / name)
        people = len(scene.world.roles) - 1
        learned = LearnedDriver(coasting_policy(), sampled=False)
        pairings: list[tuple[Driver, Driver]] = [
            (learned, learned),
            (ShieldedDriver(learned, scene.world), learned),
            (learned, SumoDriver()),
        ]
        cells = []
        for ego, driver in pairings:
            players = (mixture_of(ego, persona("careful")), *[mixture_of(driver, persona("speedy"))] * people)
            arm = SeatedArm(name="benchmark", scene=scene, drivers=players, seed=1)
            alone, together = [[episode] for episode in range(_GAMES)], [range(_GAMES)]
            turns = [(_games_per_s(arm, alone), _games_per_s(arm, together)) for _ in range(_TURNS)]
            slow, fast = map(max, zip(*turns, strict=True))
            cells.append(f"{slow:.0f} → {fast:.0f} ({fast / slow:.1f}×)")
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def _games_per_s(arm: SeatedArm, batches: Sequence[Sequence[int]]) -> float:
    start_s = time.process_time()
    played = sum(1 for _ in assess_batches(arm, batches))
    return played / (time.process_time() - start_s)
