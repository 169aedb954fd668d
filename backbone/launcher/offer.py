"""Offer: this machine runs a creator for a mission elsewhere until the mission or a signal ends the offer.

The offer outlives the link. If the link to the hub is down for ``CUT_OFF_S``, the offer ends its creator and all
components of that creator. It then reconnects to the hub, reads the mission's clock again, and starts a new creator.
It does the same if this machine's folder is removed.
The offer ends when the mission's launcher asks it to (``down``), or on a signal. If another machine has its name, the
launcher does not know this offer; it then watches the launcher and ends when the mission ends.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.authentication import read_secret_file
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import Absence, AskState, AskTime, ComponentState, LifeState, LogLevel, MissionTime
from backbone.creator.messages import ListProcesses, Processes, ProcessFell, offer_name
from backbone.errors import HubUnreachable, LinkError, Refusal
from backbone.keys import Conversation
from backbone.launcher.kept_creator import KeptCreator, LeftFiles, Offered, recorder_of_host
from backbone.launcher.link_speed import LinkSpeed
from backbone.launcher.mission_connection import REPLY_TIME_S, clock_elsewhere, connected, mission_clock
from backbone.launcher.mission_recorder import MissionRecorder
from backbone.nameserver.messages import Resolve, Resolved, UnknownName
from backbone.naming import Subsystem, legal
from backbone.operating_system.ending_signals import orders_to_end
from backbone.waiting import end_tasks, set_within
from backbone.wire import Accepts, Envelope, Message

OFFER_TYPE = "offer"
CUT_OFF_S = 3.0  # chosen: a cut shows after 2 s (the link's lease); a killed hub shows at once and is back within 3 s
SAME_TIME_S = 0.5  # chosen: two readings of one clock differ by milliseconds, over a slow link by 0.1 s
COMPARE_EACH_S = 60.0  # chosen: clocks of machines drift apart by a hundredth of a second in this time
MEASURE_EACH_S = 5.0  # chosen: a slow link is reported within 15 s, for a small message now and then
ASK_AGAIN_S = 0.1  # chosen: the nameserver answers that soon after the hub listens
PAUSE_FIRST_S, PAUSE_MOST_S, PAUSE_FACTOR = 0.2, 2.0, 1.5  # chosen: a hub that is back is found within 2 s
DIAL_TIME_S = 3.0  # chosen: longer than the retransmission of a lost first packet takes


class Ending(StrEnum):
    """Why an offer ended."""

    ORDERED = "ordered to end"
    CUT_OFF = "the link to the mission was lost"
    REPLACED = "the mission has another machine of this name"
    NO_FOLDER = "the folder of this machine's files was removed"
    OTHER_TIME = "the mission's time is no longer the one known here, as after a sleep of this machine"


class MachineOffer(Component[NoParameters]):
    """Runs a creator on this machine while the mission can be reached.

    Attributes:
        ending: Why it ended; valid after ``run``.
    """

    drains_within_s = None
    accepts: ClassVar[Accepts | None] = ListProcesses

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        creator: KeptCreator,
        on_ready: Callable[[], None],
        recorder: MissionRecorder | None = None,
        say: Callable[[str], None] = lambda _line: None,
    ) -> None:
        super().__init__(launch, bus, clock)
        self._creator, self._on_ready, self._recorder, self._say = creator, on_ready, recorder, say
        creator.on_fell, creator.on_changed = self._creator_fell, self.changed
        self._link_up, self._link_fell = asyncio.Event(), asyncio.Event()
        self._wrong_clock: Absence | None = None
        self._link_speed = LinkSpeed(launch.host)
        self.ending = Ending.ORDERED

    async def connect(self) -> None:
        """Start the recorder, then the creator, also if the recorder did not begin; end if the link is lost."""
        self.start_task(self._watch_link(), "link")
        if self._recorder is not None:
            self._recorder.on_changed = self._recorder_changed
            await self._recorder.begin_or_be_lost()
            self.start_task(self._recorder.keep(), "recorder")
        await self._creator.start(self.bus, self.clock)

    async def serve(self) -> None:
        """Report that the machine is in the mission."""
        self.start_task(self._watch_folder(), "run folder")
        self.start_task(self._watch_clock(), "clock")
        self.start_task(self._watch_link_speed(), "link speed")
        self._on_ready()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``ListProcesses`` with the creator's process."""
        if isinstance(asked.body, ListProcesses):
            return Processes(self.launch.host, [], self._creator.processes())
        return await super().answer(asked)

    def absences(self) -> list[Absence]:
        """Return creator and recorder while they do not respond, this machine while its clock is wrong or link slow."""
        lost = self._recorder.absence() if self._recorder is not None else None
        own = [absence for absence in (lost, self._wrong_clock, self._link_speed.absence) if absence is not None]
        return [*self._creator.absences(), *own]

    async def drain(self) -> None:
        """End the creator and all its components."""
        await self._creator.close()

    def _recorder_changed(self, line: str) -> None:
        self._say(line)
        self.publish_event(self.name, line, LogLevel.WARNING)
        self.changed()

    def _creator_fell(self, fell: ProcessFell) -> None:
        self.publish_event(fell.name, f"fell, {fell.how}; restarts in {fell.restart_in_s:.2g} s", LogLevel.WARNING)
        self.changed()

    async def _watch_link(self) -> None:
        """End this offer if the link stays down, or if time or machine of the mission are others when it is back."""
        self.bus.watch_link(self._link_changed)
        while True:
            await self._link_fell.wait()
            self._link_fell.clear()
            if not await set_within(self._link_up, CUT_OFF_S):
                self._end_as(Ending.CUT_OFF)
                return
            if await self._is_other_time():
                self._end_as(Ending.OTHER_TIME)
                return
            if await self._is_replaced():
                self._end_as(Ending.REPLACED)
                return

    async def _watch_folder(self) -> None:
        """End this offer if the folder is removed, because without its secret no component can start here."""
        await self._creator.wait_folder_removed(self.clock)
        self._end_as(Ending.NO_FOLDER)

    def _link_changed(self, is_up: bool) -> None:
        if is_up:
            self._link_up.set()
        else:
            self._link_up.clear()
            self._link_fell.set()  # stays set until the offer has examined it, even if the link is back at once

    async def _watch_clock(self) -> None:
        """Report this machine while its clock differs from the mission's; its processes keep the clock they began with.

        A lease begins at the earlier time of two clocks, so a wrong clock shortens grants and never extends them.
        """
        while True:
            await self.clock.sleep_s(COMPARE_EACH_S * self.clock.rate)
            try:
                right = await mission_clock(self.bus)
            except LinkError:
                continue
            ahead_s = (self.clock.now_s() - right.now_s()) / self.clock.rate
            self._wrong_clock = self._absence_of_right_time(ahead_s) if abs(ahead_s) > SAME_TIME_S else None
            self.changed()

    def _absence_of_right_time(self, ahead_s: float) -> Absence:
        since_s = self._wrong_clock.since_s if self._wrong_clock is not None else self.clock.now_s()
        side = "ahead of" if ahead_s > 0 else "behind"
        cause = f"its clock has drifted {abs(ahead_s):.1f} s {side} the mission's, so grants there may end early"
        remedy = "end the command there with Ctrl-C and type it again, so that it reads the mission's time"
        return Absence(self.launch.host, since_s, cause, "goes on with the wrong time", remedy, is_running=True)

    async def _watch_link_speed(self) -> None:
        while True:
            await self.clock.sleep_s(MEASURE_EACH_S * self.clock.rate)
            asked_s = self.clock.now_s()
            try:
                await self.bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=REPLY_TIME_S)
            except LinkError:  # the watch over the link acts on a cut
                continue
            now_s = self.clock.now_s()
            if self._link_speed.measured((now_s - asked_s) / self.clock.rate, now_s):
                self.changed()

    async def _is_other_time(self) -> bool:
        """Compare the clocks, retrying because the nameserver may answer a moment after the link is up."""
        while self._link_up.is_set():
            try:
                again = await mission_clock(self.bus)
            except LinkError:
                await self.clock.sleep_s(ASK_AGAIN_S * self.clock.rate)
            else:
                return abs(again.now_s() - self.clock.now_s()) > SAME_TIME_S * self.clock.rate
        return False

    async def _is_replaced(self) -> bool:
        """Return whether another machine got this one's name while the link was down."""
        try:
            holder = (await self.bus.ask(NAMESERVER, Resolve(self.name), Resolved, within_s=REPLY_TIME_S)).component
        except (UnknownName, LinkError):
            return False
        return holder.incarnation != self.component_state().incarnation

    def _end_as(self, ending: Ending) -> None:
        self.ending = ending
        self.end(str(ending))


class Offering:
    """Offers a machine again after each lost link. Use it inside one event loop.

    Args:
        say: Called with lines for the person at the terminal.
        secret_file: Read before each attempt, because each run of the mission has a new secret. None: the secret stays.
    """

    def __init__(self, offered: Offered, say: Callable[[str], None], secret_file: Path | None = None) -> None:
        self._offered, self._say, self._secret_file = offered, say, secret_file
        self._left = LeftFiles()
        self._current: MachineOffer | None = None
        self._lives: asyncio.Task[None] | None = None
        self._watching: asyncio.Task[None] | None = None
        self._is_ordered_to_end = self._was_in_the_mission = False
        self._said = ""

    async def run(self) -> None:
        """Offer the machine until the mission or a signal ends it.

        Raises:
            NameTaken: The mission already has a creator of this host.
            Refusal: The first creator did not start.
        """
        self._lives = asyncio.create_task(self._live_again_and_again(), name="offer")
        for number in (signal.SIGINT, *orders_to_end()):
            asyncio.get_running_loop().add_signal_handler(number, self.end)
        try:
            await self._lives
        except asyncio.CancelledError:
            if not self._is_ordered_to_end:
                raise
        finally:
            if self._watching is not None:
                await end_tasks(self._watching)

    def end(self) -> None:
        """End the creator and all its components; then ``run`` returns."""
        self._is_ordered_to_end = True
        if self._current is not None:
            self._current.end("by a signal")
        elif self._lives is not None:
            self._lives.cancel()

    async def _live_again_and_again(self) -> None:
        machine, pause_s = MissionClock.started_now(), PAUSE_FIRST_S
        while True:
            try:
                offer = await self._live()
            except LinkError as error:
                self._say_once(f"{error}; trying again, end with Ctrl-C")
            except Refusal as refusal:
                if not self._was_in_the_mission:
                    raise
                self._say_once(f"{refusal}; trying again, end with Ctrl-C")
                if self._watching is None or self._watching.done():
                    self._watching = asyncio.create_task(self._end_with_the_mission(), name="the mission's end")
            else:
                if offer.ending is Ending.ORDERED:
                    return
                self._say_once(f"{offer.ending}: all that ran here has ended; trying to reach the mission again")
                pause_s = PAUSE_FIRST_S
            if self._is_ordered_to_end:
                return
            await machine.sleep_s(pause_s)
            pause_s = min(pause_s * PAUSE_FACTOR, PAUSE_MOST_S)

    async def _live(self) -> MachineOffer:
        """Run one offer, from the hub's first answer to the end of the offer."""
        if self._secret_file is not None:
            self._offered = replace(self._offered, secret=read_secret_file(self._secret_file))
        offered = self._offered
        await _dial(offered)
        name = offer_name(offered.host)
        source = f"{Subsystem.BACKBONE}/{name}"
        try:
            clock = await clock_elsewhere(offered.mission, offered.endpoint, source, offered.secret)
            launch = _launch(offered, name, clock)
            creator, recorder = KeptCreator(launch, offered, self._left), recorder_of_host(offered, clock)
            config = client_config(offered.endpoint, offered.secret)
            bus = await ZenohBus.open_when_up(offered.mission, source, clock, config)
        except HubUnreachable as error:
            raise HubUnreachable(
                f"a hub listens at {offered.endpoint} and does not let this machine in: the secret is missing or not "
                "the mission's (--secret-file), or the hub is just starting"
            ) from error
        offer = self._current = MachineOffer(launch, bus, clock, creator, self._is_in_the_mission, recorder, self._say)
        try:
            await offer.run()
        finally:
            await creator.close()
            if recorder is not None:
                await recorder.end()
            self._current = None
        return offer

    async def _end_with_the_mission(self) -> None:
        """End when the launcher ends the mission, because it does not know an offer without a name."""
        offered, ends = self._offered, asyncio.Event()

        def heard(launcher: ComponentState) -> None:
            if launcher.state is LifeState.DRAINING:
                ends.set()

        source = f"{Subsystem.BACKBONE}/{offer_name(offered.host)}"
        with contextlib.suppress(LinkError):  # the next refusal begins the watch again
            async with connected(offered.mission, offered.endpoint, source, offered.secret) as (bus, _clock):
                bus.subscribe(LAUNCHER, Conversation.STATUS, ComponentState, lambda told: heard(told.body))
                heard(await bus.ask(LAUNCHER, AskState(), ComponentState, within_s=REPLY_TIME_S))
                await ends.wait()
                self._say_once(f"mission {offered.mission} ends")
                self.end()

    def _is_in_the_mission(self) -> None:
        if self._watching is not None:
            self._watching.cancel()
        self._was_in_the_mission = True
        self._say_once(f"{self._offered.host} is in mission {self._offered.mission}")

    def _say_once(self, line: str) -> None:
        if line != self._said:
            self._said = line
            self._say(line)


async def _dial(offered: Offered) -> None:
    """Return when a process listens at the endpoint; unlike opening a bus this can be interrupted.

    Raises:
        HubUnreachable: No process listens at the endpoint.
    """
    protocol, _, where = offered.endpoint.partition("/")
    host, _, port = where.partition("?")[0].partition("#")[0].rpartition(":")
    if protocol != "tcp" or not port.isdecimal():
        return
    try:
        async with asyncio.timeout(DIAL_TIME_S):
            _, writer = await asyncio.open_connection(host.strip("[]"), int(port))
    except OSError as error:  # includes TimeoutError
        raise HubUnreachable(f"no hub listens at {offered.endpoint}: {_reason(error)}") from error
    writer.close()


def _reason(error: OSError) -> str:
    if isinstance(error, socket.gaierror):
        return "no such host"
    return os.strerror(error.errno) if error.errno else "no answer"


def _launch(offered: Offered, name: str, clock: MissionClock) -> Launch:
    return Launch(
        mission=offered.mission,
        subsystem=Subsystem.BACKBONE,
        name=name,
        type=OFFER_TYPE,
        class_path="",
        host=legal(offered.host),
        endpoint=offered.endpoint,
        clock_origin_monotonic_s=clock.origin_monotonic_s,
        clock_rate=clock.rate,
    )
