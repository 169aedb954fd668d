"""The cable of one machine is cut: the others notice nothing, and its components are heard again afterwards."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from namespaces import NetworkHost, hosts_on_a_switch

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

ROLES = Path(__file__).parent / "bus_roles.py"
CROWD = 16  # more than the threads through which a hub receives
LEASE_S = 2.0
BACK_WITHIN_S = 10.0


@contextlib.contextmanager
def playing(role: str, host: NetworkHost, endpoint: str) -> Iterator[subprocess.Popen[str]]:
    """Give a role when it is ready; it is killed afterwards."""
    command = [sys.executable, str(ROLES), role, endpoint, str(CROWD)]
    with host.start(command, dict(os.environ), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            assert said_by(process) == "ready"
            yield process
        finally:
            process.kill()


def said_by(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


@pytest.mark.thorough
@pytest.mark.parametrize("cut_s", [3.4, 3.8, 4.2])
def test_a_cut_cable_stops_no_one_else_and_makes_no_one_deaf(tmp_path: Path, cut_s: float) -> None:
    with contextlib.ExitStack() as stack:
        hosts = stack.enter_context(hosts_on_a_switch(tmp_path, "base", "far"))
        base, far, endpoint = hosts["base"], hosts["far"], f"tcp/{hosts['base'].address}:7447"
        for role, host in (("hub", base), ("crowd", far)):
            stack.enter_context(playing(role, host, endpoint))
        asker = stack.enter_context(playing("asker", base, endpoint))
        far.cut()
        time.sleep(cut_s)
        far.heal()
        print(BACK_WITHIN_S, file=asker.stdin, flush=True)
        meanwhile = json.loads(said_by(asker))
        assert meanwhile["unanswered"] == 0, meanwhile
        assert meanwhile["asked"] > 10 * (cut_s - LEASE_S), meanwhile
        assert json.loads(said_by(asker)) == {"deaf": []}
        assert asker.wait(10) == 0
