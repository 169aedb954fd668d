"""A hub that has nearly all files open that the system allows says so, before it can connect no further process."""

from __future__ import annotations

from typing import Any

import pytest
from test_nameserver_service import nameserver, probe

from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.log_level import LogLevel
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.nameserver import service
from backbone.nameserver.service import SPARE_FILES

MOST = 1024


def said_with(monkeypatch: pytest.MonkeyPatch, beside: Any, used: list[int | None]) -> list[StoryEvent]:
    """Return what the nameserver publishes if it has so many open files at each registration; None: all of them."""
    left = iter(used)

    def open_files() -> int:
        now = next(left)
        if now is None:
            raise OSError(24, "Too many open files")
        return now

    monkeypatch.setattr(service, "open_files", open_files)
    monkeypatch.setattr(service, "most_files", lambda: MOST)
    said = list[StoryEvent]()

    async def main() -> None:
        network, clock = LocalNetwork("m"), VirtualClock()
        ear = network.join("ui_console/ear", clock)
        ear.subscribe(NAMESERVER, Conversation.LOG, StoryEvent, lambda heard: said.append(heard.body))
        async with beside(nameserver(network, endpoint="a hub's")):
            for number in range(len(used)):
                async with beside(probe(network, f"scout{number}")):
                    await clock.sleep_s(1.0)
        await ear.close()

    run_virtual(main())
    return [event for event in said if "files" in event.what]


def test_it_is_said_once_with_the_numbers(monkeypatch: pytest.MonkeyPatch, beside: Any) -> None:
    few = MOST - SPARE_FILES
    said = said_with(monkeypatch, beside, [few, few + 1, few + 4])
    assert [event.what.partition(":")[0] for event in said] == [f"has {few + 1} of {MOST} files open"]
    assert said[0].level is LogLevel.ALARM


def test_it_is_said_again_when_files_run_out_again(monkeypatch: pytest.MonkeyPatch, beside: Any) -> None:
    assert len(said_with(monkeypatch, beside, [MOST, 100, None])) == 2


def test_a_hub_with_files_to_spare_says_nothing(monkeypatch: pytest.MonkeyPatch, beside: Any) -> None:
    assert not said_with(monkeypatch, beside, [70, 73, 76])
