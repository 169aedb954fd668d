"""The feed of a map: the robots' places, the plan of the floor, and the robots' cameras.

Localizers publish a place when it changes. The feed asks a localizer that has been silent for long. Without a
localizer, it asks the simulated world, which knows all places, a few times a second. While no page shows the map, it
asks nothing.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from backbone.addresses import COMPONENT_DATABASE
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import ComponentState, LifeState
from backbone.component_database.messages import ListTypes, Types
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Components, Disappeared
from backbone.naming import component_of
from backbone.wire import Envelope, Message
from resource_pool.arc_client import AskFloorPlan, AskPose, FloorPlan, Pose
from ui_console.model.events import Heard, Said

log = logging.getLogger(__name__)

LOCALIZER, WORLD = "localizer", "simulated_world"  # shipped types, ``backbone/mission/shipped_types.xml``
LOOK_EVERY_S = 0.25  # chosen: as often as a page shows it; machine seconds
QUIET_S = 1.0  # chosen: a third of the age at which a place counts as old; mission seconds
REPLY_TIME_S = 1.0  # chosen: as for a console's other questions; machine seconds
AGAIN_S = 5.0  # chosen: a localizer that does not know a robot yet may know it then; mission seconds


class MapFeed:
    """Turns messages about places into events.

    Args:
        show: Called in the event loop with each event, in order.
    """

    def __init__(self, bus: Bus, clock: Clock, show: Callable[[Heard], None]) -> None:
        self._bus, self._clock, self._show = bus, clock, show
        self._there: dict[str, ComponentState] = {}
        self._heard_s: dict[str, float] = {}
        self._unknown_s: dict[tuple[str, str], float] = {}
        self._asked: set[tuple[str, int, str]] = set()
        self._is_watched = asyncio.Event()

    def listen(self) -> None:
        """Subscribe; once, before ``run``."""
        self._bus.subscribe("*/*", Conversation.POSES, Pose, self._published)

    def watch(self, is_watched: bool) -> None:
        """Note whether a page shows the map."""
        if is_watched:
            self._is_watched.set()
        else:
            self._is_watched.clear()

    def heard(self, said: Said) -> None:
        """Record the components of the mission."""
        match said:
            case ComponentState(address=at, state=LifeState.STOPPED):  # may come after ``Disappeared``
                self._there.pop(at, None)
            case ComponentState(address=at):
                self._there[at] = said
            case Components(components=components):
                self._there = {one.address: one for one in components}
            case Disappeared(address=at):
                self._there.pop(at, None)

    async def run(self) -> None:
        """While a page shows the map, ask for data that is not published; until cancelled."""
        while True:
            await self._is_watched.wait()
            await self._look()
            await self._clock.sleep_s(LOOK_EVERY_S * self._clock.rate)

    async def _look(self) -> None:
        robots = sorted(component_of(one.address) for one in self._there.values() if one.is_robot)
        known_types = [one for one in (self._there.get(COMPONENT_DATABASE),) if one is not None]
        asking = [self._ask_once(one, ListTypes(), Types) for one in known_types]
        localizers, now_s = self._of_type(LOCALIZER), self._clock.now_s()
        if localizers:
            bodies = sorted(self._heard_s.keys() | robots)
            robots = [body for body in bodies if now_s - self._heard_s.get(body, -QUIET_S) >= QUIET_S]
        for at in (localizers or self._of_type(WORLD))[:1]:
            asking.append(self._ask_once(at, AskFloorPlan(), FloorPlan))
            asking += [self._ask_pose(at, robot) for robot in robots]
        await asyncio.gather(*asking)

    def _of_type(self, kind: str) -> list[ComponentState]:
        ready = [one for one in self._there.values() if one.type == kind and one.state is LifeState.READY]
        return sorted(ready, key=lambda one: one.address)

    async def _ask_pose(self, of: ComponentState, robot: str) -> None:
        key = of.address, robot
        if self._clock.now_s() < self._unknown_s.get(key, -AGAIN_S) + AGAIN_S:
            return
        try:
            pose = await self._bus.ask(of.address, AskPose(robot), Pose, within_s=REPLY_TIME_S)
        except Refusal as refusal:
            self._unknown_s[key] = self._clock.now_s()
            log.info("%s does not know where %s is: %s", of.address, robot, refusal)
        except LinkError as error:
            log.info("%s did not answer where %s is: %s", of.address, robot, error)
        else:
            self._take(pose, of.address)

    async def _ask_once(self, of: ComponentState, question: Message, kind: type[FloorPlan] | type[Types]) -> None:
        """Ask each process of a component until it has answered or refused."""
        key = of.address, of.pid, kind.__name__
        if key in self._asked:
            return
        try:
            answer = await self._bus.ask(of.address, question, kind, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s did not answer: %s", of.address, error)
            return
        except Refusal as refusal:
            log.info("%s has no answer: %s", of.address, refusal)
        else:
            self._show(Heard(self._clock.now_s(), answer, of.address))
        self._asked.add(key)

    def _published(self, envelope: Envelope[Pose]) -> None:
        self._take(envelope.body, envelope.source)

    def _take(self, pose: Pose, source: str) -> None:
        now_s = self._clock.now_s()
        self._heard_s[pose.body] = now_s
        self._show(Heard(now_s, pose, source))
