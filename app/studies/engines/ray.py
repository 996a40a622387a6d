"""A Ray cluster: one of this machine, begun and ended here, or one that runs already."""

import os
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any
from warnings import catch_warnings

from app.errors import ConfigError
from app.studies.engines import Means, Run, Trial, lost, needed
from app.studies.pool import THREADS
from app.studies.trial import TrialResult, TrialSpec

WAITING = 4  # trials a processor that are handed over: a whole study is too much to look through


def engine(means: Means, place: str = "") -> Run:
    """place: '' of this machine, 'auto' the one that it belongs to, else HOST:PORT."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nobody is told
    if not place:  # without clusters, on any system, nothing listens to other machines
        os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
    ray = needed("ray", "ray")

    def run(trial: Trial, specs: Sequence[TrialSpec]) -> Iterator[tuple[TrialSpec, TrialResult]]:
        _connect(ray, place, means.jobs)
        try:
            task = ray.remote(num_cpus=1, max_retries=1)(trial)
            most = WAITING * max(1, int(ray.cluster_resources().get("CPU", 1)))
            rest, pending = iter(specs), dict[Any, TrialSpec]()
            while True:
                while len(pending) < most and (spec := next(rest, None)) is not None:
                    pending[task.remote(spec)] = spec
                if not pending:
                    return
                for done in ray.wait(list(pending))[0]:
                    spec = pending.pop(done)
                    try:
                        result = ray.get(done)
                    except ray.exceptions.RayError as e:
                        result = lost(spec, str(e).partition("\n")[0])
                    yield spec, result
        finally:
            ray.shutdown()

    return run


def _connect(ray: ModuleType, place: str, jobs: int) -> None:
    """Begin a cluster here, or join one; ConfigError where there is none."""
    more: dict[str, Any] = {"runtime_env": {"env_vars": dict.fromkeys(THREADS, "1")}}
    if not place:
        more |= {"num_cpus": jobs, "include_dashboard": False}
    known = place in ("", "auto") or place.startswith("//")
    address = {"": "local", "auto": "auto"}.get(
        place, f"ray:{place}" if known else f"ray://{place}"
    )
    try:
        with catch_warnings(action="ignore"):  # that there is no cluster is told below
            ray.init(address, log_to_driver=False, logging_level="error", **more)
    except ConnectionError as e:
        why = str(e).partition("\n")[0]
        raise ConfigError(
            f"engine = 'ray:{place}': no Ray cluster answers ({why}); begin it with "
            "'ray start --head', and give its token in RAY_AUTH_TOKEN if it has one"
        ) from e
