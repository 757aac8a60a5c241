# SPDX-License-Identifier: Apache-2.0
"""Who runs the tasks: threads that start processes here, or the workers of a Dask cluster."""

import concurrent.futures
from collections.abc import Iterator

from ignis.errors import InputError
from ignis.sweeping.grid import Task
from ignis.sweeping.task import Row, run_task, stop_all

_CONNECT_S = 10


def run_locally(tasks: list[Task], jobs: int) -> Iterator[tuple[Task, Row]]:
    """So many replays at a time; an interruption ends them."""
    pool = concurrent.futures.ThreadPoolExecutor(jobs)
    futures = {pool.submit(run_task, task): task for task in tasks}
    try:
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        stop_all()
        raise
    pool.shutdown()


def run_on_dask(tasks: list[Task], scheduler: str) -> Iterator[tuple[Task, Row]]:
    """On an existing cluster whose workers see the same files; a worker that dies costs a retry, not the sweep."""
    from distributed import Client, as_completed

    try:
        client = Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from None
    with client:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            raise InputError(f"the Dask scheduler at {scheduler} has no workers")
        by_key = {f"ignis-{task.folder}": task for task in tasks}
        futures = [client.submit(run_task, task, key=key, pure=False, retries=1) for key, task in by_key.items()]
        for future in as_completed(futures, loop=client.loop):
            task = by_key[str(future.key)]
            if future.status == "finished":
                yield task, future.result()
            else:
                yield task, {"status": "failed", "failure": f"on the cluster: {future.exception()}"}
