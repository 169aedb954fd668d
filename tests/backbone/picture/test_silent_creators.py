"""A creator that does not answer: on the first host the launcher replaces it, elsewhere its offer does."""

from __future__ import annotations

import pytest

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import Absence, AskTime, ComponentState, LifeState, MissionTime
from backbone.creator.messages import ListProcesses, Processes
from backbone.nameserver.messages import Components, ListComponents
from backbone.picture.health import HealthWord, health
from backbone.picture.look import look
from backbone.wire import Envelope, Message


async def seen(*types: tuple[str, str]) -> tuple[Absence, ...]:
    """Return what is missed if the services answer, but no component of these types and hosts does."""
    network, clock = LocalNetwork("m"), VirtualClock()
    listed = [ComponentState(f"backbone/{kind}-{host}", kind, host, 7, LifeState.READY, 0.0) for kind, host in types]
    listed.append(ComponentState(NAMESERVER, "nameserver", "base", 7, LifeState.READY, 0.0))

    async def answer(asked: Envelope[Message]) -> Message:
        match asked.body:
            case ListComponents():
                return Components(listed, True, 0.0)
            case AskTime():
                return MissionTime(0.0, 1.0, 0.0)
            case _:
                return Processes("base", [], [])

    buses = {at: network.join(at, clock) for at in (NAMESERVER, RC_MANAGER, PLACER, LAUNCHER)}
    for at, bus in buses.items():
        bus.serve(at, ListComponents | AskTime | ListProcesses, answer)
    picture = await look(buses[LAUNCHER], 100.0, schedule=False)
    for bus in buses.values():
        await bus.close()
    return picture.missed


@pytest.mark.parametrize(
    ("types", "doing", "word"),
    [
        ([("creator", "base")], "the launcher restarts it", HealthWord.FAILED),
        ([("creator", "far"), ("offer", "far")], "far restarts it if it hangs", HealthWord.DEGRADED),
        ([("creator", "far")], "far restarts it if it hangs", HealthWord.DEGRADED),  # its offer's link fell first
    ],
)
def test_who_replaces_a_silent_creator_is_told_and_a_slow_link_fails_no_mission(
    types: list[tuple[str, str]], doing: str, word: HealthWord
) -> None:
    async def main() -> None:
        [silent] = await seen(*types)
        assert (silent.name, silent.doing) == (f"creator-{types[0][1]}", doing)
        assert health({}, [silent], 100.0 + 60.0).word is word

    run_virtual(main())
