"""The callback of a training: it bounds the actions' standard deviation, and records the learning curve."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from harness.environments.vector_env import Finished, GamesVecEnv
from harness.game.outcome import Outcome
from harness.training.checkpoint import CurvePoint, Progress

CURVE_WINDOW_STEPS = 16_384


class CurveRecorder(BaseCallback):
    """Records the learning curve of a segment, reports progress, and bounds the standard deviation of actions.

    Actions are clipped at ±1: beyond the bound the entropy term of PPO still rewards a larger deviation, which is no
    exploration any more, but full throttle and full brake in turn.
    """

    def __init__(
        self,
        environment: GamesVecEnv,
        progress: Progress,
        *,
        steps: int,
        step_s: float,
        largest_deviation: Callable[[int], float],
        on_progress: Callable[[int, int], None],
    ) -> None:
        """`progress` is that of the segments before; `steps` is the training's budget, of steps of `step_s` seconds;
        `largest_deviation` is the bound after so many of them."""
        super().__init__()
        self._environment, self._on_progress, self._largest_deviation = environment, on_progress, largest_deviation
        self._steps, self._step_s = steps, step_s
        self._window: list[Finished] = []
        self._window_start = progress.steps
        self.windows, self.games = list(progress.curve), list[Finished]()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._bound_deviation()

    def _on_rollout_end(self) -> None:
        finished = self._environment.take_finished()
        self._window += finished
        self.games += finished
        if self.num_timesteps - self._window_start >= CURVE_WINDOW_STEPS:
            self._close_window()
        self._on_progress(self.num_timesteps, self._steps)

    def _on_training_end(self) -> None:
        self._bound_deviation()  # the stored policy is within the bound as well
        self._close_window()  # a window contains games of one segment only, so a short segment has a short window
        self.logger.dump(self.num_timesteps)

    def _bound_deviation(self) -> None:
        deviation: Any = self.model.policy.log_std
        with torch.no_grad():
            deviation.clamp_(max=float(np.log(self._largest_deviation(self.num_timesteps))))

    def _close_window(self) -> None:
        games = self._window
        if not games:
            return
        window = CurvePoint(
            steps=self.num_timesteps,
            mean_payoff=float(np.mean([game.payoff for game in games])),
            failure_rate=float(np.mean([game.outcome != Outcome.GOAL for game in games])),
            games=len(games),
            mean_duration_s=float(np.mean([game.steps for game in games])) * self._step_s,
        )
        for name in ("mean_payoff", "failure_rate", "mean_duration_s"):
            self.logger.record(f"games/{name}", getattr(window, name))
        self.windows.append(window)
        self._window, self._window_start = [], self.num_timesteps
