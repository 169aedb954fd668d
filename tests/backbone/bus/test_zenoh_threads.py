"""The threads of zenoh in a process: two in a client; in a hub those that a blocked receiver cannot stop."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, cast

import pytest
import zenoh
from free_ports import free_endpoint

from backbone.bus.zenoh_bus import client_config

FLOOD = 100  # for each of four senders: more than the 256 messages that wait in a client of zenoh
PROGRAM = """
import sys, pathlib, zenoh
from backbone.bus.zenoh_bus import client_config, hub_config
from backbone.bus.zenoh_threads import threads_of_a_hub, few_threads
few_threads()
if sys.argv[1] == "hub":  # forked by a process of few threads
    threads_of_a_hub()
with zenoh.open((hub_config([sys.argv[2]]) if sys.argv[1] == "hub" else client_config(sys.argv[2]))) as session:
    if sys.argv[1] == "client":  # threads begin with what they do first
        list(session.get("asked/of/nobody"))
    print("open", flush=True)
    sys.stdin.readline()
    names = {task.joinpath("comm").read_text().strip() for task in pathlib.Path("/proc/self/task").iterdir()}
    print(*sorted({name[:-2] for name in names} & {"rx", "tx", "acc", "net", "app"}), flush=True)
    sys.stdin.readline()
"""


@pytest.mark.processes
def test_a_client_has_threads_that_receive_and_send_and_a_hub_none_that_only_accepts() -> None:
    endpoint = free_endpoint()
    found: list[list[str]] = []
    with opened("hub", endpoint) as hub, opened("client", endpoint) as client:
        for each in (client, hub):
            assert each.stdin is not None
            assert each.stdout is not None
            each.stdin.write("\n")
            each.stdin.flush()
            found.append(each.stdout.readline().split())
        for each in (client, hub):
            each.communicate("\n", timeout=30)
    assert set(found[0]) == {"rx", "tx"}
    assert {"rx", "tx", "net"} <= set(found[1])
    assert "acc" not in found[1]


@pytest.mark.processes
def test_a_flood_to_a_slow_client_passes_the_hub_whole() -> None:
    """Where its sockets belonged to the threads that receive, 6 of 300 such messages arrived."""
    endpoint, came = free_endpoint(), list[int]()

    def take(sample: zenoh.Sample) -> None:
        time.sleep(0.005)
        came.append(len(sample.payload))

    with opened("hub", endpoint) as hub, ExitStack() as sessions:
        slow, *senders = [sessions.enter_context(zenoh.open(client_config(endpoint))) for _ in range(5)]
        slow.declare_subscriber("flood", take)
        blocking = zenoh.CongestionControl.BLOCK
        publishers = [sender.declare_publisher("flood", congestion_control=blocking) for sender in senders]
        wait_until(lambda: all(cast("Any", each).matching_status.matching for each in publishers), "the hub knows it")
        floods = [threading.Thread(target=flood, args=[publisher]) for publisher in publishers]
        for each in floods:
            each.start()
        wait_until(lambda: len(came) == FLOOD * len(floods), "all arrived")
        for each in floods:
            each.join()
        hub.communicate("\n\n", timeout=30)


def flood(publisher: zenoh.Publisher) -> None:
    """Publish at once what takes the slow client a while."""
    for _ in range(FLOOD):
        publisher.put(bytes(200_000))


def wait_until(holds: Callable[[], bool], what: str) -> None:
    """Wait for it without an event loop."""
    deadline_s = time.monotonic() + 30.0
    while not holds():
        assert time.monotonic() < deadline_s, what
        time.sleep(0.01)


def opened(role: str, endpoint: str) -> subprocess.Popen[str]:
    """Return a process whose session is open."""
    command = [sys.executable, "-c", PROGRAM, role, endpoint]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "open\n"
    return process
