"""Many trials on all cores."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from mission_control.laboratory.harness import WorkerKilled, results_of, run_all


def squared(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def picky(number: int) -> int:
    if number == 7:
        raise ArithmeticError("seven")
    return number


def long_after_the_first(number: int) -> int:
    if number:
        time.sleep(60.0)
    return number


def killed_at_seven(number: int) -> int:
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def threads_and_frozen(_number: int) -> tuple[str | None, str | None, int]:
    environment = os.environ
    return environment.get("OPENCV_FOR_THREADS_NUM"), environment.get("OPENBLAS_NUM_THREADS"), gc.get_freeze_count()


@pytest.mark.processes
def test_other_processes_keep_to_one_core_and_look_through_what_lasts_once() -> None:
    found = run_all(threads_and_frozen, range(20), jobs=2)
    assert {(opencv, openblas) for opencv, openblas, _ in found} == {("1", "1")}
    assert found[0][2] < found[1][2]  # an interpreter may begin with frozen objects


@pytest.mark.processes
def test_results_come_in_the_order_of_the_orders_from_other_processes() -> None:
    found = run_all(squared, range(20), jobs=2)
    assert [value for value, _ in found] == [number * number for number in range(20)]
    assert os.getpid() not in {process for _, process in found}


def test_one_job_is_this_process() -> None:
    assert {process for _, process in run_all(squared, range(3), jobs=1)} == {os.getpid()}


def test_progress_is_told_after_each_result() -> None:
    told: list[tuple[int, int]] = []
    run_all(squared, range(3), jobs=1, progress=lambda done, of: told.append((done, of)))
    assert told == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.processes)])
def test_the_first_failure_is_raised(jobs: int) -> None:
    with pytest.raises(ArithmeticError, match="seven"):
        run_all(picky, range(12), jobs=jobs)


@pytest.mark.processes
def test_a_killed_process_ends_the_work_with_a_fault_of_its_own() -> None:
    with pytest.raises(WorkerKilled, match="was killed"):
        run_all(killed_at_seven, range(1000), jobs=2)


@pytest.mark.processes
def test_work_that_nobody_wants_any_more_is_not_awaited() -> None:
    results = results_of(long_after_the_first, range(8), jobs=2)
    assert next(results) == 0
    began_s = time.monotonic()
    results.close()
    assert time.monotonic() - began_s < 30.0


@pytest.mark.processes
def test_other_processes_end_with_the_one_that_gives_the_orders_however_it_ends(tmp_path: Path) -> None:
    program = tmp_path / "orders.py"
    program.write_text(ORDERS)
    with subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True) as giver:
        assert giver.stdout is not None
        workers = [psutil.Process(int(pid)) for pid in giver.stdout.readline().split()]
        giver.kill()
    _ended, left = psutil.wait_procs(workers, timeout=10.0)
    for worker in left:
        worker.kill()
    assert (len(workers), left) == (2, [])


ORDERS = """
import multiprocessing
import time

from mission_control.laboratory.harness import results_of

def work(number):
    time.sleep(0.2)
    return number

if __name__ == "__main__":
    for _ in results_of(work, range(1000), jobs=2):
        print(*(child.pid for child in multiprocessing.active_children()), flush=True)
"""
