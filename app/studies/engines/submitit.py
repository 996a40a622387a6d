"""A SLURM cluster by submitit, or its stand-in of this machine where there is none."""

import time
from collections.abc import Iterator, Sequence
from functools import partial
from math import ceil
from typing import Any

from app.errors import ConfigError
from app.studies.engines import Means, Run, Trial, lost, needed
from app.studies.pool import one_thread
from app.studies.trial import TrialResult, TrialSpec

LOOK = 0.5  # [s] between looks at the queue
SPAN = 600.0  # [s] of simulated time a job: queues take no thousands of short ones
CLUSTERS = ("local", "slurm")


def engine(means: Means, place: str = "") -> Run:
    """place: 'local' for processes of this machine, a partition of the cluster, or ''."""
    submitit = needed("submitit", "cluster")
    if means.folder is None:
        raise ConfigError("engine = 'submitit': jobs need a folder that all see; give --out DIR")
    executor = submitit.AutoExecutor(means.folder, place if place in CLUSTERS else None)
    failed = submitit.core.utils.UncompletedJobError

    def run(trial: Trial, specs: Sequence[TrialSpec]) -> Iterator[tuple[TrialSpec, TrialResult]]:
        size = max(1, min(int(SPAN / specs[0].seconds), ceil(len(specs) / means.jobs)))
        todo = [specs[i : i + size] for i in range(0, len(specs), size)]
        minutes = ceil(sum(map(means.seconds, todo[0])) / 60.0)
        partition = {"slurm_partition": place} if place and place not in CLUSTERS else {}
        executor.update_parameters(timeout_min=minutes, cpus_per_task=1, **partition)
        pending = dict[Any, Sequence[TrialSpec]]()
        try:
            while todo or pending:
                with one_thread():
                    while todo and len(pending) < means.jobs:  # the stand-in starts all at once
                        some = todo.pop(0)
                        pending[executor.submit(partial(_all, trial, some))] = some
                for job in [job for job in pending if job.done()]:
                    try:
                        results = job.result()
                    except failed as e:
                        results = [lost(s, str(e).partition("\n")[0]) for s in pending[job]]
                    yield from zip(pending.pop(job), results, strict=True)
                time.sleep(LOOK)
        finally:
            for job in pending:
                job.cancel()

    return run


def _all(trial: Trial, specs: Sequence[TrialSpec]) -> list[TrialResult]:
    return list(map(trial, specs))
