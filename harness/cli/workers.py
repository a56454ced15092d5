"""Where the stages of a campaign are carried out: the option, and what it selects."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from harness.campaign.execution.run_stages import StartWorkers

Ray = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run the stages on a Ray cluster: **local** (started on this machine for the run), **auto** (the one that "
        "runs on this machine) or HOST:PORT. docs/scaling.md describes it.  [default: processes of this machine]",
        show_default=False,
    ),
]


@contextmanager
def started_on(ray: str | None, jobs: int | None, warn: Callable[[str], None]) -> Iterator[StartWorkers]:
    """What carries stages out: processes of this machine, or a Ray cluster, which is connected during the block.

    Raises UsageError where there is no such cluster.
    """
    from harness.campaign.execution.worker_pool import WorkerPool, cores

    if ray is None:
        yield partial(WorkerPool, jobs=jobs or cores())
        return
    from harness.campaign.execution.ray_cluster import ray_cluster
    from harness.campaign.execution.ray_workers import RayWorkers

    with ray_cluster(ray, jobs) as cluster:
        yield partial(RayWorkers, ray=cluster, jobs=jobs, warn=warn)
