from __future__ import annotations

import asyncio
import os
import subprocess
import sys

import pytest

from backbone.creator.process_table import (
    MARK,
    Process,
    descendants,
    read_line,
    read_table,
    remains,
    tree,
    zygote_title,
    zygotes_of,
)
from backbone.operating_system.processes import environment, wait_gone


def alive(parent: int, group: int, title: str = "x") -> Process:
    return Process(parent, group, title, is_gone=False)


CREATOR, ITS_ZYGOTE = 20, 21
TABLE = {
    10: alive(1, 10, zygote_title(1)),
    CREATOR: alive(10, 20),
    ITS_ZYGOTE: alive(20, 21, zygote_title(CREATOR)),
    30: alive(21, 30, "scout1"),
    31: alive(30, 30, "sleep"),
    32: alive(30, 32, "own group"),
    33: alive(21, 30, "orphan of 30"),
    34: Process(30, 30, "zombie", is_gone=True),
}


def test_a_component_is_itself_its_group_and_its_descendants() -> None:
    assert tree(TABLE, 30) == {30, 31, 32, 33}


def test_a_creator_does_not_include_its_zygote_nor_what_that_forked() -> None:
    assert tree(TABLE, CREATOR) == {CREATOR}
    assert descendants(TABLE, 10) == {CREATOR}
    assert zygotes_of(TABLE, CREATOR) == {ITS_ZYGOTE}


def test_what_a_dead_component_left_is_known_by_its_group() -> None:
    table = {pid: process for pid, process in TABLE.items() if pid != 30}
    assert remains(table, 30) == {31, 33}


def test_a_zombie_is_nothing_that_is_left() -> None:
    assert remains({34: TABLE[34]}, 30) == set()


def test_a_title_may_hold_anything() -> None:
    assert read_line("5 (a) b (c)) Z 4 5 3 0 -1") == Process(4, 5, "a) b (c)", is_gone=True)


def test_the_table_knows_this_process() -> None:
    own = read_table()[os.getpid()]
    assert (own.parent, own.group, own.is_gone) == (os.getppid(), os.getpgid(0), False)


def test_an_environment_that_cannot_be_read_is_empty() -> None:
    assert environment(0) == []


@pytest.mark.processes
def test_what_left_the_group_by_another_program_is_known_by_its_environment() -> None:
    component = 4_194_305  # no pid: Linux gives none above 2**22
    environ, waits = {**os.environ, MARK: str(component)}, [sys.executable, "-c", "print(flush=True); input()"]
    with subprocess.Popen(waits, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environ) as program:
        assert program.stdout is not None
        program.stdout.readline()  # a program that has just begun has no environment yet
        assert remains(read_table(), component) == {program.pid}
        assert remains(read_table(), component, adopter=os.getpid()) == {program.pid}
        assert remains(read_table(), component, adopter=program.pid) == set()
        program.kill()


def sleeper() -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)


@pytest.mark.processes
async def test_waiting_for_the_gone_returns_when_all_are() -> None:
    sleepers = [sleeper(), sleeper()]
    waiting = asyncio.create_task(wait_gone([one.pid for one in sleepers]))
    for one in sleepers:
        assert not waiting.done()
        assert one.stdin is not None
        one.stdin.close()
        await asyncio.to_thread(one.wait)
    await asyncio.wait_for(waiting, 5.0)
    await wait_gone([one.pid for one in sleepers])
