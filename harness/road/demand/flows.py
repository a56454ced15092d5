"""Flows of a route file: their rates, and the times at which their vehicles depart."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from harness.game.arrays import FloatArray

LEAST_PERIOD_S = 0.05
MOST_AT_ONCE = 1000  # vehicles of a flow that all depart at its begin
_LEAST_DENSITY = 1e-9


@dataclass(frozen=True, kw_only=True)
class FlowRate:
    """The rate of a flow: one of a period, a mean period of random departures, and a probability per second."""

    period_s: float | None = None
    mean_period_s: float | None = None
    probability_per_s: float | None = None
    number: int | None = None
    """The number of vehicles after which the flow ends."""
    spread: bool = False
    """Whether the period follows from the number: with a density of 2, twice as many vehicles depart."""


def times_of(
    rate: FlowRate, *, first_s: float, end_s: float, begin_s: float, density: float, generator: np.random.Generator
) -> list[tuple[int, float]]:
    """The number and the time of each departure of a flow, which runs from `first_s` to `end_s`, from `begin_s` on.

    `density` is a factor on the rate. Vehicles with a fixed period are numbered from the flow's begin, the others from
    `begin_s`.
    """
    if density < _LEAST_DENSITY:
        return []
    number = rate.number
    if number is not None and rate.spread:
        number = round(number * density)
    if rate.period_s == 0.0:
        return [(k, first_s) for k in range(number or 0) if begin_s <= first_s]
    if rate.period_s is not None:
        skipped, times = _regular_times(first_s, end_s, begin_s, rate.period_s / density)
    elif rate.mean_period_s is not None:
        skipped, times = 0, _random_times(max(first_s, begin_s), end_s, rate.mean_period_s / density, generator)
    else:  # in each second a vehicle departs with a probability; above 1: one for certain, and more
        seconds = np.arange(first_s + max(ceil(begin_s - first_s), 0), end_s, 1.0)
        expected = (rate.probability_per_s or 0.0) * density
        skipped, times = 0, np.repeat(seconds, np.ceil(expected - generator.random(len(seconds))).astype(int))
    numbered = [(skipped + k, time) for k, time in enumerate(times.tolist())]
    return numbered if number is None else [each for each in numbered if each[0] < number]


def _regular_times(first_s: float, end_s: float, begin_s: float, period_s: float) -> tuple[int, FloatArray]:
    """The number of the first time from `begin_s` on, and the times."""
    before = max(ceil((begin_s - first_s) / period_s) - 2, 0)  # rounding may move a time by one period
    after = max(ceil((end_s - first_s) / period_s) + 2, before)
    times: FloatArray = first_s + period_s * np.arange(before, after)
    skipped = int(np.searchsorted(times, begin_s))
    return before + skipped, times[skipped : np.searchsorted(times, end_s)]


def _random_times(begin_s: float, end_s: float, mean_period_s: float, generator: np.random.Generator) -> FloatArray:
    """The times of a Poisson process. It has no memory, and so may begin at any time of the flow."""
    expected = max(end_s - begin_s, 0.0) / mean_period_s
    times: FloatArray = begin_s + np.cumsum(generator.exponential(mean_period_s, int(expected + 5 * expected**0.5) + 5))
    while times[-1] < end_s:
        times = np.append(times, times[-1] + np.cumsum(generator.exponential(mean_period_s, 20)))
    return times[times < end_s]
