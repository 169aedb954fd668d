"""Processes in one event loop: paused, starved and killed each by itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from backbone.bus.clock import VirtualClock
from backbone.creator.silence import LOOK_EVERY_S, SHOWN_AFTER_S, Silence
from mission_control.laboratory.simulation.audit import Audit
from mission_control.laboratory.simulation.simulated_processes import ProcessLoop, SimulatedProcess, run_processes

CLOCK = VirtualClock()


class Scene:
    """One process that counts, and one that sends it numbers."""

    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, ProcessLoop)
        self.loop = loop
        self.process = SimulatedProcess(loop, "scout1", "h1", 1)
        self.did: list[tuple[float, str]] = []

    def note(self, what: str) -> None:
        self.did.append((round(CLOCK.now_s(), 3), what))

    async def tick(self) -> None:
        while True:
            await CLOCK.sleep_s(1.0)
            self.note("tick")

    def begin(self) -> None:
        self.ticking = self.loop.create_task(self.tick(), context=self.process.context)

    def send(self, what: str) -> None:
        self.process.run(self.loop.call_soon, self.note, what)


def play(body: Callable[[Scene], Awaitable[None]]) -> None:
    async def main() -> None:
        scene = Scene()
        scene.begin()
        await body(scene)
        scene.process.die()
        scene.ticking.cancel()

    run_processes(main())


def test_a_paused_process_does_nothing_and_then_what_arrived_before_what_became_due() -> None:
    async def body(scene: Scene) -> None:
        await CLOCK.sleep_until_s(1.5)
        scene.process.pause()
        await CLOCK.sleep_until_s(3.0)
        scene.send("asked")
        await CLOCK.sleep_until_s(4.0)
        assert scene.did == [(1.0, "tick")]
        scene.process.go_on()
        await CLOCK.sleep_until_s(4.5)
        assert scene.did == [(1.0, "tick"), (4.0, "asked"), (4.0, "tick")]

    play(body)


def test_two_pauses_end_with_the_later_one() -> None:
    async def body(scene: Scene) -> None:
        scene.process.pause()
        scene.process.pause()
        scene.process.go_on()
        await CLOCK.sleep_until_s(2.5)
        assert scene.did == []
        scene.process.go_on()
        await CLOCK.sleep_until_s(2.6)
        assert scene.did == [(2.5, "tick")]

    play(body)


def test_a_paused_process_is_silent_and_a_starved_one_is_not() -> None:
    async def silence_s(scene: Scene, lasts_s: float) -> float:
        silence, most_s = Silence(), 0.0
        until_s = CLOCK.now_s() + lasts_s
        while CLOCK.now_s() < until_s:
            most_s = max(most_s, silence.look(scene.process.vitals(), CLOCK.now_s()))
            await CLOCK.sleep_s(LOOK_EVERY_S)
        return most_s

    async def body(scene: Scene) -> None:
        assert await silence_s(scene, 5.0) == 0.0
        scene.process.starve(CLOCK.now_s() + 20.0, 2.5)
        assert await silence_s(scene, 20.0) < SHOWN_AFTER_S
        scene.process.pause()
        assert await silence_s(scene, 5.0) > 4.0

    play(body)


def test_a_starved_process_works_only_now_and_then_and_in_order() -> None:
    async def body(scene: Scene) -> None:
        scene.process.starve(10.0, 3.5)
        for number in range(10):
            await CLOCK.sleep_until_s(number + 0.1)
            scene.send(str(number))
        await CLOCK.sleep_until_s(20.0)
        numbers = [what for _, what in scene.did if what != "tick"]
        assert numbers == [str(number) for number in range(10)]
        assert {at_s for at_s, _ in scene.did if at_s < 10.0} == {1.0, 4.5, 8.0}

    play(body)


def test_nothing_is_recorded_of_a_process_that_is_dead() -> None:
    """The steps that waited run to their ends; the audit took them for acts."""

    async def body(scene: Scene) -> None:
        audit = Audit()
        scene.process.pause()
        scene.process.run(scene.loop.call_soon, audit.note, "scout1", "packet")
        audit.note("scout1", "killed")
        scene.process.die()
        await CLOCK.sleep_s(1.0)
        assert [each.what for each in audit.happenings] == ["killed"]

    play(body)
