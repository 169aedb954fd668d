"""Meetings: the placer collects tags and processes of each creator that appears, and listens to its reports."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Subscription
from backbone.component.messages import ComponentState, LifeState
from backbone.creator.messages import CUT_OFF_ENDS_WITHIN_S, HostLoad, ProcessFell
from backbone.errors import LinkError
from backbone.keys import Conversation
from backbone.nameserver.messages import RECONNECT_S
from backbone.naming import component_of
from backbone.placer.creators import ANSWER_WITHIN_S, Creators, creator_of
from backbone.placer.decisions import Inspect, Instruction
from backbone.wire import Envelope

LEAVING = (LifeState.DRAINING, LifeState.STOPPED, LifeState.FAILED)

Work = Callable[[], Coroutine[object, None, None]]


class Meetings:
    """Keeps the book's hosts up to date with the living creators."""

    def __init__(
        self,
        creators: Creators,
        *,
        own_host: str,
        remember: Callable[[str], None],
        note: Callable[[str, str], object],
        carry_out: Callable[[list[Instruction]], None],
        begin: Callable[[Work, str], None],
        begin_later: Callable[[Work, str], None],
    ) -> None:
        """Meet no creator yet.

        Args:
            creators: Lists the creators and their processes; its ``news`` get the end of each meeting.
            own_host: Host of the placer: a creator there is never cut off.
            remember: Saves the name of another host that has a creator for the next placer.
            note: Subject, event → the story.
            carry_out: Carries out the book's instructions.
            begin: Starts a task with a name.
            begin_later: Starts a task with a name, once the placer serves.
        """
        self._creators, self._bus, self._clock = creators, creators.bus, creators.clock
        self._book, self._news = creators.book, creators.news
        self._own_host, self._remember = own_host, remember
        self._note, self._carry_out = note, carry_out
        self._begin, self._begin_later = begin, begin_later
        self._meeting: dict[str, int] = {}
        self._newest: dict[str, int] = {}
        self._inspecting: set[str] = set()
        self._is_looking = False
        self._ears: dict[str, list[Subscription]] = {}

    def are_under_way(self) -> bool:
        """Return whether a creator is being met."""
        return bool(self._meeting)

    def inspect(self, host: str) -> None:
        """Compare the host's processes with the book, unless that is under way: then the next load inspects again."""
        if host not in self._inspecting:
            self._inspecting.add(host)
            self._begin_later(partial(self._inspect_now, host), f"inspect {host}")

    def _load_heard(self, heard: Envelope[HostLoad]) -> None:
        """Also look again if this creator counts as lost: the news of its return may not have come."""
        self._carry_out(self._book.load_heard(heard.body))
        if not self._book.is_alive(heard.body.host) and not self._meeting and not self._is_looking:
            self._is_looking = True
            self._begin_later(self._look_once, "look again")

    async def _look_once(self) -> None:
        try:
            await self.look_again()
        finally:
            self._is_looking = False

    def _fall_heard(self, heard: Envelope[ProcessFell]) -> None:
        fell = heard.body
        then = f"restart in {fell.restart_in_s:g} s" if fell.restart_in_s >= 0 else "not restarted"
        self._note(fell.name, f"fell: {fell.how}; {then}")
        record = self._book.find(fell.name)
        if record is not None and fell.restart_in_s < 0:
            self._carry_out(self._book.component_disappeared(record.address))

    def _creator_status_heard(self, heard: Envelope[ComponentState]) -> None:
        """Place a creator's components again as soon as it drains; its token exists until it has ended them."""
        creator = heard.body
        if creator.state in LEAVING and self._book.knows_creator(creator.host, creator.start):
            self._carry_out(self._book.creator_down(creator.host, self._clock.now_s()))

    async def look_again(self) -> None:
        """Compare the nameserver's list of creators with the book; a complete list also shows missing creators."""
        while True:
            try:
                found = await self._creators.listed()
            except LinkError as error:  # when the nameserver is back, its token starts this again
                self._note(component_of(NAMESERVER), f"does not list the creators: {error}")
                return
            for creator in found.components:
                if creator.state in LEAVING:
                    self._carry_out(self._book.creator_down(creator.host, self._clock.now_s()))
                elif self._book.knows_creator(creator.host, creator.start):
                    self._carry_out([Inspect(creator.host)])
                else:
                    self.begin_meeting(creator)
            if found.complete:
                break
            back_s = found.hub_since_s + RECONNECT_S * self._clock.rate
            await self._clock.sleep_s(max(back_s - self._clock.now_s(), RECONNECT_S / 10 * self._clock.rate))
        there = {creator.host for creator in found.components}
        for host in self._book.hosts():
            if host.name not in there:
                self.lost_sight_of(host.name)

    def lost_sight_of(self, host: str) -> None:
        """Record the end of a creator's token: a creator of this host died, one of another host may be cut off."""
        fence_s = 0.0 if host == self._own_host else CUT_OFF_ENDS_WITHIN_S * self._clock.rate
        self._carry_out(self._book.creator_down(host, self._clock.now_s(), fence_s))

    def begin_meeting(self, creator: ComponentState) -> None:
        """Meet this creator, unless it is being met."""
        if self._newest.get(creator.host) != creator.start or creator.host not in self._meeting:
            self._newest[creator.host] = creator.start
            self._begin(partial(self.meet, creator), f"meet {creator.host}")

    async def meet(self, creator: ComponentState) -> None:
        """Collect a creator's tags and processes, and subscribe to its reports."""
        host, asked_s = creator.host, self._clock.now_s()
        self._newest[host] = creator.start
        self._meeting[host] = self._meeting.get(host, 0) + 1
        if host not in self._ears:
            own = creator_of(host)
            self._ears[host] = [
                self._bus.subscribe(own, Conversation.TELEMETRY, HostLoad, self._load_heard, latest=True),
                self._bus.subscribe(own, Conversation.EVENTS, ProcessFell, self._fall_heard),
                self._bus.subscribe(own, Conversation.STATUS, ComponentState, self._creator_status_heard),
            ]
        try:
            answered = await self._creators.list_processes(host)
        except LinkError as error:  # it may only be slow: ask again while its token exists
            self._note(host, f"its creator does not list its processes: {error}")
            self._begin_later(partial(self._meet_later, creator), f"meet {host} later")
            return
        finally:
            self._meeting[host] -= 1
            if not self._meeting[host]:
                del self._meeting[host]
            self._news.tell()
        if host != self._own_host:
            self._remember(host)
        if self._newest[host] == creator.start:  # else the placer meets its successor instead
            self._carry_out(self._book.creator_up(host, answered.tags, creator.start, answered.processes, asked_s))

    async def _meet_later(self, creator: ComponentState) -> None:
        await self._clock.sleep_s(ANSWER_WITHIN_S * self._clock.rate)
        try:
            found = await self._creators.listed()
        except LinkError:  # the nameserver's return makes the placer look again
            return
        is_there = any(each.incarnation == creator.incarnation for each in found.components)
        if is_there and not self._book.knows_creator(creator.host, creator.start):
            self.begin_meeting(creator)

    async def _inspect_now(self, host: str) -> None:
        asked_s = self._clock.now_s()
        processes = await self._creators.processes_on(host)
        self._inspecting.discard(host)
        if processes is not None:
            self._carry_out(self._book.inspected(host, processes.processes, asked_s))
