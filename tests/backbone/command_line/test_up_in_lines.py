"""The lines of a mission that is up without a live picture."""

from __future__ import annotations

import gc
import io

from rich.console import Console

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.mission_console import ConsoleObserver
from backbone.component.messages import Absence, ComponentState, LifeState, StoryEvent
from backbone.keys import Conversation
from backbone.picture.health import HealthWord, MissionHealth


def test_consoles_that_came_and_went_are_not_kept_but_named_by_their_people() -> None:
    lines = io.StringIO()

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        observer = ConsoleObserver(Console(file=lines), live=False)
        observer.connected(network.join("backbone/launcher", clock))
        for number in range(100):
            address = f"ui_console/passing-{number}"
            bus = network.join(address, clock)
            state = ComponentState(address, "console", "base", number, LifeState.READY, 0.0, user=f"Anna {number}")
            bus.publish(address, Conversation.STATUS, state)
            story = StoryEvent(0.0, address, f"was taken by passing-{number}-drive", "scout1", "")
            bus.publish(address, Conversation.LOG, story)
            await clock.sleep_s(1.0)
            await bus.close()
        kept = [one for one in gc.get_objects() if issubclass(type(one), dict) and "ui_console/passing-7" in one]
        assert kept == []

    run_virtual(scene())
    assert "was taken by Anna 99" in lines.getvalue()


def test_sixty_components_that_start_are_one_line() -> None:
    lines = io.StringIO()
    radios = [Absence(f"radio{number}", 4.0, "no process yet", "its owner asks for it") for number in range(60)]

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        await clock.sleep_s(5.0)
        ConsoleObserver(Console(file=lines), live=False).connected(network.join("backbone/up", clock))
        launcher = network.join("backbone/launcher", clock)
        launcher.publish("backbone/launcher", Conversation.HEALTH, MissionHealth(HealthWord.STARTING, radios))
        await clock.sleep_s(1.0)

    run_virtual(scene())
    [line] = lines.getvalue().splitlines()
    assert line.startswith("  … each of 60 components (radio0, ")


def test_a_long_wait_is_told_less_and_less_often() -> None:
    lines = io.StringIO()

    async def scene() -> None:
        clock, network = VirtualClock(), LocalNetwork("lines")
        ConsoleObserver(Console(file=lines), live=False).connected(network.join("backbone/up", clock))
        launcher = network.join("backbone/launcher", clock)
        for second in range(1, 400):
            await clock.sleep_s(1.0)
            missing = [
                Absence(host, 0.0, "no creator yet", "waits") for host in ("far", "farther")[: 1 + (second > 299)]
            ]
            launcher.publish("backbone/launcher", Conversation.HEALTH, MissionHealth(HealthWord.STARTING, missing))

    run_virtual(scene())
    told = [line for line in lines.getvalue().splitlines() if "farther" not in line]
    assert 8 <= len(told) <= 14
    assert "farther is absent for 300.0 s" in lines.getvalue()
