"""Runs many trials or missions on all cores; the results do not depend on the number of processes."""

from __future__ import annotations

import gc
import multiprocessing
import os
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TypeVar

from backbone.errors import BackboneError

Order = TypeVar("Order")
Result = TypeVar("Result")

BATCH = 5  # chosen: seconds of work: the last process does not run alone for long, and cached pictures are reused

OBJECTS_AT_ONCE = 20_000  # chosen: some megabytes of garbage; Python's own 700 are for programs that have less


class WorkerKilled(BackboneError):
    """A process that ran some of the work ended without a result."""


Progress = Callable[[int, int], None]
"""Callback with the number of finished trials and of all trials."""


def run_all(
    work: Callable[[Order], Result],
    orders: Sequence[Order],
    *,
    jobs: int = 0,
    progress: Progress | None = None,
) -> list[Result]:
    """Run the work for each order and return the results in the same order.

    Args:
        work: A module-level function, so that other processes can import it; its result depends only on its order.
        orders: Arguments of the calls, one for each result; orders and results must be picklable.
        jobs: Number of processes; 0: one per core; 1: this process.

    Raises:
        WorkerKilled: A process was killed.
        Exception: The first exception of the work; no further call is started.
    """
    results: list[Result] = []
    for result in results_of(work, orders, jobs=jobs, chunk=BATCH):
        results.append(result)
        if progress is not None:
            progress(len(results), len(orders))
    return results


def results_of(
    work: Callable[[Order], Result], orders: Sequence[Order], *, jobs: int = 0, chunk: int = 1
) -> Generator[Result, None, None]:
    """Yield the results in the order of the orders; after the generator is closed or interrupted, no call runs on.

    Args:
        work: As for ``run_all``.
        orders: Same.
        jobs: Same.
        chunk: Number of orders that a process gets at a time.

    Raises:
        WorkerKilled: A process was killed.
    """
    jobs = jobs or os.cpu_count() or 1
    if jobs == 1 or len(orders) <= 1:
        yield from map(work, orders)
        return
    # Spawned, not forked: a fork of a process with threads of its own may hang.
    context = multiprocessing.get_context("spawn")
    # A pipe, because an event waits for ever for the answer of a process that was killed.
    orders_end, wanted = context.Pipe(duplex=False)
    with ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(orders_end,)) as pool:
        chunks = [orders[at : at + chunk] for at in range(0, len(orders), chunk)]
        try:
            # Not by ``pool.map``, which cancels calls that are not awaited: Python 3.11 then prints a bug of its own.
            for done in [pool.submit(_worked, work, part) for part in chunks]:
                yield from done.result()
        except BaseException as error:
            wanted.close()  # else a person who interrupts waits for half a minute of work
            if isinstance(error, BrokenProcessPool):
                raise WorkerKilled(
                    "a process that ran some of the work was killed; if memory is short, run less"
                ) from error
            raise
        finally:
            pool.shutdown(wait=True)
            wanted.close()
            orders_end.close()


def _begin(orders_end: Connection) -> None:
    _keep_to_one_core()
    threading.Thread(target=_end_with, args=(orders_end,), daemon=True).start()


def _end_with(orders_end: Connection) -> None:
    """End at once when nobody wants the results any more, also because the process that gives the orders has ended."""
    with suppress(EOFError, OSError):
        orders_end.recv_bytes()
    os._exit(1)


def _keep_to_one_core() -> None:
    """Let OpenCV and OpenBLAS, which are imported later, start no threads: the other cores have work of their own."""
    for threads in ("OPENCV_FOR_THREADS_NUM", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")


def _worked(work: Callable[[Order], Result], orders: Sequence[Order]) -> list[Result]:
    """Do the work; after the first, the garbage collector has little to do.

    What was imported by then and is kept it never looks through again, and it looks for garbage less often.
    """
    results = []
    for order in orders:
        results.append(work(order))
        if gc.get_threshold()[0] != OBJECTS_AT_ONCE:  # asking how many objects are frozen would count them all
            gc.collect()
            gc.freeze()
            gc.set_threshold(OBJECTS_AT_ONCE)
    return results
