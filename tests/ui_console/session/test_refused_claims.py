"""A claim that was refused leaves nothing behind: no subscription, and nothing that the next claim would double."""

from __future__ import annotations

from collections import Counter
from typing import Any

from driven_console import console, grant_at_once
from fake_resource_pool import FakePlacer

from backbone.errors import Refusal
from backbone.keys import Conversation
from resource_pool.arc_client import Frame
from ui_console.model.events import CommandRefused, ConsoleEvent

ROBOT = "resource_pool/scout1"


def heard(placer: FakePlacer) -> Counter[Conversation]:
    """Count the subscriptions to pictures, and to stops of the robot."""
    listening = [one for some in placer.network.listeners.values() for one in some]
    of_robot = [one for one in listening if one.conversation is Conversation.FRAMES or one.pattern == ROBOT]
    return Counter(one.conversation for one in of_robot)


def test_a_claim_that_is_refused_closes_what_it_opened(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        pictures: list[Frame] = []
        placer.on_arc = grant_at_once
        placer.refusals["video_drive"] = Refusal("no robot of this name")
        async with beside(console(placer, events.append, see=pictures.append)) as driven:
            for times in range(1, 4):
                driven.take()
                await placer.wait(lambda: sum(isinstance(one, CommandRefused) for one in events) == times)  # noqa: B023
                await placer.clock.sleep_s(1.0)
                assert not heard(placer)
            del placer.refusals["video_drive"]
            driven.take()
            await placer.wait(lambda: driven.is_held)
            assert heard(placer) == {Conversation.FRAMES: 1, Conversation.EVENTS: 1}
            [arc] = placer.arcs.values()
            arc.publish(bytes(4), 2, 2)
            await placer.wait(lambda: pictures)
            await placer.clock.sleep_s(1.0)
            assert len(pictures) == 1

    placer_world(scene)


def test_a_robot_is_given_back_also_if_its_arc_refuses_the_release(placer_world: Any, beside: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        events: list[ConsoleEvent] = []
        placer.on_arc = grant_at_once
        async with beside(console(placer, events.append)) as driven:
            driven.take()
            await placer.wait(lambda: driven.is_held)
            [arc] = placer.arcs.values()
            arc.release_refusal = Refusal("another component owns this ARC")
            await driven.give_back(for_good=True)
            assert not driven.is_held
            assert arc.name in placer.stopped
            assert not heard(placer)

    placer_world(scene)
