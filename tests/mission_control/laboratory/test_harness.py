"""Many trials on all cores."""

from __future__ import annotations

import gc
import os

import pytest

from mission_control.laboratory.harness import run_all


def squared(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def picky(number: int) -> int:
    if number == 7:
        raise ArithmeticError("seven")
    return number


def threads_and_frozen(_number: int) -> tuple[str | None, str | None, int]:
    environment = os.environ
    return environment.get("OPENCV_FOR_THREADS_NUM"), environment.get("OPENBLAS_NUM_THREADS"), gc.get_freeze_count()


@pytest.mark.processes
def test_other_processes_keep_to_one_core_and_look_through_what_lasts_once() -> None:
    found = run_all(threads_and_frozen, range(20), jobs=2)
    assert {(opencv, openblas) for opencv, openblas, _ in found} == {("1", "1")}
    assert found[0][2] == 0
    assert found[1][2] > 0


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
