"""The cable of one machine is cut: the others notice nothing, and its components are heard again afterwards."""

from __future__ import annotations

import contextlib
import json
import time
from pathlib import Path

import pytest
from bus_roles import playing, said_by
from namespaces import hosts_on_a_switch

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

LEASE_S = 2.0
BACK_WITHIN_S = 10.0


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
