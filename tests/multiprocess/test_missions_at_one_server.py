"""``scout-console serve`` for two missions that are up on this machine, at one address."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from running_mission import BIN, RunningMission, mission_up
from websockets.asyncio.client import connect

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

WITHIN_S = 30.0


@contextmanager
def serving_all(*missions: RunningMission) -> Iterator[dict[str, str]]:
    """Serve missions of one runtime folder; yield the addresses that are printed, by mission."""
    named = [word for mission in missions for word in ("--mission", mission.name)]
    words = [str(BIN / "scout-console"), "serve", "--port", "0", *named]
    with subprocess.Popen(words, env=missions[0].environment, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            lines = [server.stdout.readline() for _mission in missions]
            found = [re.fullmatch(r"(\S+): (http://127\.0\.0\.1:\d+/m/\S+)\n", line) for line in lines]
            yield {one[1]: one[2] for one in found if one is not None}
        finally:
            server.terminate()
            assert server.wait(timeout=WITHIN_S) == 0


async def shown_at(address: str) -> dict[str, Any]:
    """Return what the page at an address with a token shows."""
    at, token = address.replace("http:", "ws:").split("#token=")
    view: dict[str, Any] = {}
    async with connect(f"{at}socket", proxy=None) as socket:
        await socket.send(json.dumps({"do": "hello", "token": token}))
        while not view.get("robots"):
            message = await socket.recv()
            view |= json.loads(message).get("view", {}) if isinstance(message, str) else {}
    return view


@pytest.mark.thorough
async def test_each_of_two_missions_has_its_page_and_one_may_end() -> None:
    with mission_up() as day, mission_up(beside=day) as night, serving_all(day, night) as addresses:
        for mission in (day, night):
            view = await shown_at(addresses[mission.name])
            assert view["welcome"]["mission"] == mission.name
            assert {robot["robot"] for robot in view["robots"]} == {"scout1", "scout2", "scout3"}
        assert len({address.partition("#")[2] for address in addresses.values()}) == 2
        assert day.down() == 0
        assert (await shown_at(addresses[night.name]))["welcome"]["mission"] == night.name
