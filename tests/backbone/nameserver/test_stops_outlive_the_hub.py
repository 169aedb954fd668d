"""The stop of a robot whose RC is down outlives a restart of the hub, for an RC on another host."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_nameserver_service import Probe, nameserver, probe

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import LastStop, StandingStop
from backbone.nameserver.stops_file import FILE_NAME

FIRE, LIFTED = LastStop(3, StandingStop(3, "anna", "fire", 1.0)), LastStop(3)


class Stoppable(Probe):
    """A component that an operator has stopped, and that takes over the stop of its former process."""

    stop = LastStop()

    def last_stop(self) -> LastStop:
        return self.stop

    def resume_stop(self, last: LastStop) -> None:
        self.stop = last


async def _stop_of_the_next(network: LocalNetwork, beside: Any, name: str = "scout1") -> LastStop:
    """Return the stop that the next component of this name takes over, on another host."""
    second = probe(network, name, Stoppable, host="b")
    async with beside(second):
        await VirtualClock().sleep_s(2.0)
        return second.last_stop()


async def _stopped_and_gone(network: LocalNetwork, beside: Any, *then: LastStop) -> None:
    """Run a component that is stopped, then has these stops, then ends."""
    first = probe(network, kind=Stoppable)
    first.stop = FIRE
    async with beside(first):
        for stop in then:
            await VirtualClock().sleep_s(1.0)
            first.stop = stop
            first.changed()
        await VirtualClock().sleep_s(1.0)


@pytest.mark.parametrize(("then", "taken_over"), [((), FIRE), ((LIFTED,), LIFTED)], ids=["stopped", "lifted"])
def test_a_restarted_hub_still_knows_the_stop_of_a_robot_whose_rc_is_down(
    tmp_path: Path, beside: Any, then: tuple[LastStop, ...], taken_over: LastStop
) -> None:
    async def main() -> None:
        network = LocalNetwork()
        async with beside(nameserver(network, str(tmp_path))):
            await _stopped_and_gone(network, beside, *then)
        async with beside(nameserver(network, str(tmp_path))):
            assert await _stop_of_the_next(network, beside) == taken_over

    run_virtual(main())


def test_if_the_file_of_stops_cannot_be_read_each_robot_that_registers_anew_is_stopped(
    tmp_path: Path, beside: Any
) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"half of a")

    async def main() -> None:
        network = LocalNetwork()
        async with beside(nameserver(network, str(tmp_path))):
            stop = (await _stop_of_the_next(network, beside)).standing
            assert stop is not None
            assert "cannot be read" in stop.reason
            free = probe(network, "scout2", Stoppable)
            async with beside(free):
                free.stop = LastStop()
                free.changed()
                await VirtualClock().sleep_s(1.0)
            assert await _stop_of_the_next(network, beside, "scout2") == LastStop(), "it was seen free since"

    run_virtual(main())


def test_a_hub_that_cannot_keep_a_stop_says_so_and_goes_on(tmp_path: Path, beside: Any) -> None:
    (tmp_path / f".{FILE_NAME}.saving").mkdir()  # nothing can be written there

    async def main() -> None:
        network = LocalNetwork()
        hub = nameserver(network, str(tmp_path))
        async with beside(hub):
            await _stopped_and_gone(network, beside)
            assert any("will not know which robots are stopped" in one.what for one in hub.story.of("nameserver"))
            assert await _stop_of_the_next(network, beside) == FIRE

    run_virtual(main())
