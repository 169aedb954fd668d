"""How many threads of zenoh a process has: two in a client, all of them in a hub."""

from __future__ import annotations

import subprocess
import sys

import pytest
from free_ports import free_endpoint

PROGRAM = """
import sys, pathlib, zenoh
from backbone.bus.zenoh_bus import client_config, hub_config
from backbone.bus.zenoh_threads import all_threads, few_threads
few_threads()
if sys.argv[1] == "hub":  # forked by a process of few threads
    all_threads()
with zenoh.open((hub_config([sys.argv[2]]) if sys.argv[1] == "hub" else client_config(sys.argv[2]))):
    print("open", flush=True)
    sys.stdin.readline()
    names = {task.joinpath("comm").read_text().strip() for task in pathlib.Path("/proc/self/task").iterdir()}
    print(*sorted({name[:-2] for name in names} & {"rx", "tx", "acc", "net", "app"}), flush=True)
    sys.stdin.readline()
"""


@pytest.mark.processes
def test_a_client_has_threads_that_receive_and_send_and_a_hub_also_those_that_accept() -> None:
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
    assert {"rx"} <= set(found[0]) <= {"rx", "tx"}  # the sender begins with the first message
    assert "acc" in found[1]


def opened(role: str, endpoint: str) -> subprocess.Popen[str]:
    """Return a process whose session is open."""
    command = [sys.executable, "-c", PROGRAM, role, endpoint]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "open\n"
    return process
