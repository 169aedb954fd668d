"""The client interface of the resource pool: decision processes import nothing else of it.

A decision process (behavior or console) claims an ARC, gets a notice at the begin and end of each grant, and sends
commands during a grant. The ARC refuses commands outside a grant.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.messages import NameTaken, Stop, Stopping
from backbone.component.peer_monitor import PeerMonitor
from backbone.errors import LinkError, Refusal, ReplyTimeout
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.placer.messages import CreatorSilent, Ended, Start, Started, StopComponent
from backbone.placer.wishes import Wish
from backbone.scheduling.requests import PathNode, Usage
from backbone.wire import Envelope, Message
from resource_pool.drivers.world_messages import AskPose, Pose
from resource_pool.messages import (
    DEFAULT_DRIVE_USAGE,
    Accepted,
    Applied,
    ArcNotice,
    ArcState,
    AskArc,
    AskBeat,
    Drive,
    Frame,
    Halt,
    Jump,
    NoSuchAction,
    Noted,
    Release,
    Resumed,
    SliceEnds,
    Suspended,
    Suspending,
    SwappedOut,
    WantIdle,
    WantLonger,
    WantRuntime,
)
from resource_pool.stop_knowledge import StopKnowledge
from resource_pool.stop_messages import (
    AskStop,
    EmergencyStop,
    EmergencyStopped,
    GivenBeforeStop,
    LiftStop,
    OtherStop,
    Stopper,
    StopState,
)

__all__ = [
    "DEFAULT_DRIVE_USAGE",
    "Applied",
    "ArcClient",
    "ArcListener",
    "ArcNotice",
    "ArcState",
    "AskBeat",
    "AskPose",
    "EmergencyStopped",
    "Frame",
    "GivenBeforeStop",
    "NoSuchAction",
    "NotMyArc",
    "Noted",
    "OtherStop",
    "PathNode",
    "Pose",
    "Resumed",
    "SliceEnds",
    "StopState",
    "Stopper",
    "Suspended",
    "Suspending",
    "SwappedOut",
    "Usage",
    "arc_name",
    "ask_stop",
    "claim_parameters",
    "lift_stop",
    "notice_arc",
    "stop_robot",
    "watch_stops",
]

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: a command that takes longer justifies a stop
START_TIME_S = 30.0  # chosen: an ARC may have to wait for RCs that are starting


class NotMyArc(Refusal):
    """This decision process does not claim the ARC of the notice."""

    code = "arc.not_mine"
    remedy = "Nothing to do: an ARC whose owner does not know it ends by itself."


class ArcListener(Protocol):
    """A decision process's reactions to the begin and end of grants."""

    async def arc_resumed(self, notice: Resumed) -> None:
        """Continue: commands pass from now on."""

    async def arc_suspending(self, notice: Suspending) -> None:
        """Stop cleanly; return after that, within ``notice.deadline_s``."""

    async def arc_suspended(self, notice: Suspended) -> None:
        """Stop sending commands, because the RCs are gone; keep your state."""


class ArcClient:
    """A decision process's client of one ARC, named ``arc_name(bus, kind)``; ``keep`` claims it.

    Its component passes each ``ArcNotice`` question to ``handle``, also while the ARC is still starting.
    """

    def __init__(self, bus: Bus, arc: str, listener: ArcListener, not_now: Callable[[], float] | None = None) -> None:
        """Begin with nothing claimed.

        Args:
            bus: Bus of the decision process.
            arc: Name of the ARC.
            listener: Called at the begin and end of grants.
            not_now: Called shortly before the end of a slice that can be extended, if the ARC was claimed with
                ``may_say_not_now``: seconds still needed; 0: none.
        """
        self.arc = arc
        self.address = address(Subsystem.RESOURCE_POOL, arc)
        self.wish = Wish(arc)
        self.granted: Resumed | None = None
        self.suspended: Suspended | None = None
        self._bus, self._listener, self._not_now = bus, listener, not_now
        self._granted, self._suspended = asyncio.Event(), asyncio.Event()
        self._suspended.set()
        self._frames: Subscription | None = None
        self._stops = StopKnowledge()

    async def keep(
        self,
        clock: Clock,
        kind: str,
        parameters: dict[str, Any],
        *,
        rests: bool = False,
        patience_s: float = 0.0,
        on_changed: Callable[[], None] = lambda: None,
    ) -> None:
        """Claim the ARC, and claim it again whenever it is gone, until cancelled.

        If a grant ends with its ARC, the listener gets ``arc_suspended`` with the reason ``lost``.

        Args:
            clock: The mission's clock.
            kind: Component type of the ARC: ``drive``, ``video_drive``, ``capture``.
            parameters: Made by ``claim_parameters``.
            rests: True: the ARC was started with these parameters before and rests; it is only asked to want time
                again, unless it is gone.
            patience_s: Time in which a refused first start is repeated, seconds of the machine, because a host may be
                returning or an ARC of an earlier life may be ending.
            on_changed: Called when ``wish.absence()`` may have changed.

        Raises:
            Refusal: The ARC did not start, or its request can never be served.
        """
        is_there = rests and await self._wake()
        give_up_s = clock.now_s() + patience_s * clock.rate
        while True:
            if not is_there:
                await self._start_anew(clock, kind, parameters, on_changed, give_up_s)
            is_there = False
            self.wish.placed()
            on_changed()
            monitor = PeerMonitor(self._bus, self.address)
            watching = [
                asyncio.create_task(self._agree_after_absence(monitor), name=f"{self.arc}:agree"),
                asyncio.create_task(self._note_absence(monitor, clock, on_changed), name=f"{self.arc}:absence"),
            ]
            try:
                await monitor.wait_gone()
            finally:
                monitor.close()
                for task in watching:
                    task.cancel()
                await asyncio.gather(*watching, return_exceptions=True)
            self.wish.missing("it ended while it was wanted", clock.now_s())
            on_changed()
            await self._lost()

    async def handle(self, notice: ArcNotice) -> Noted:
        """Record a notice of the ARC and call the listener; return the reply to the ARC.

        Raises:
            NotMyArc: The notice comes from another ARC than the claimed one.
        """
        if notice_arc(notice) not in ("", self.arc):
            raise NotMyArc(f"{notice_arc(notice)} is not claimed here, {self.arc} is", arc=notice_arc(notice))
        match notice:
            case Resumed():
                if self.granted is not None and self.granted.epochs == notice.epochs:
                    if notice.until_s > self.granted.until_s:
                        self.granted = notice
                    return Noted()  # repeated: the first answer was lost, or a heartbeat was earlier
                await self._lost()
                self.granted, self.suspended = notice, None
                self._granted.set()
                self._suspended.clear()
                await self._listener.arc_resumed(notice)
            case SliceEnds():
                return Noted(self._not_now() if self._not_now is not None and self.granted is not None else 0.0)
            case Suspending():
                await self._listener.arc_suspending(notice)
            case Suspended():
                if self.granted is None and self.suspended == notice:
                    return Noted()
                self.granted, self.suspended = None, notice
                self._granted.clear()
                self._suspended.set()
                await self._listener.arc_suspended(notice)
            case AskBeat(state=state):
                if state is not None and state.arc == self.arc:
                    await self._agree(state)
        return Noted()

    async def wait_granted(self) -> Resumed:
        """Return when the RCs are granted."""
        while self.granted is None:
            await self._granted.wait()
        return self.granted

    async def drive(self, left_rad_s: float, right_rad_s: float) -> Applied:
        """Turn the wheels; return the speeds that were applied after clipping.

        Raises:
            SwappedOut: The ARC has no grant; no packet was sent.
            EmergencyStopped: An operator has stopped the robot, or stopped it between the last command and this one.
        """
        return await self._move(Drive(left_rad_s, right_rad_s, self._last_stop()))

    async def halt(self) -> Applied:
        """Stop the wheels; see ``drive``."""
        return await self._command(Halt())

    async def jump(self) -> Applied:
        """Jump; see ``drive``."""
        return await self._move(Jump(self._last_stop()))

    def heard_stop(self, state: StopState) -> bool:
        """Record that a robot was stopped or freed; return whether this is news.

        The next command counts as given with knowledge of the stop, so show the stop to a person before.
        """
        return self._stops.heard(state)

    def frames(self, listener: Callable[[Frame], None]) -> Subscription:
        """Call the listener with the newest picture of the present grant; pictures of earlier grants never arrive."""

        def arrived(envelope: Envelope[Any]) -> None:
            frame: Frame = envelope.body
            if self.granted is not None and self.granted.epochs.get(frame.rc) == frame.epoch:
                listener(frame)

        return self._bus.subscribe(self.address, Conversation.FRAMES, Frame, arrived, latest=True)

    async def wait_stop_lifted(self, robot: str) -> None:
        """Return when no operator's stop is in force on this robot.

        Raises:
            LinkError: The robot's RC did not answer.
        """
        lifted = asyncio.Event()

        def heard(state: StopState) -> None:
            self.heard_stop(state)
            if not state.is_stopped:
                lifted.set()

        hearing = watch_stops(self._bus, heard, robot)
        try:
            heard(await ask_stop(self._bus, robot))
            await lifted.wait()
        finally:
            hearing.close()

    async def state(self) -> ArcState:
        """Return the ARC's RCs, or why it has no grant."""
        return await self._bus.ask(self.address, AskArc(), ArcState, within_s=REPLY_TIME_S)

    async def idle(self, idle: bool = True) -> None:
        """Want no time, or want time again."""
        await self._request(WantIdle(idle))

    async def rest(self) -> None:
        """Give the RCs back and keep the ARC, which wants no time until ``keep`` with ``rests``.

        When: during a grant, because a waiting ARC could be granted at this moment. Afterwards the ARC holds no RC, and
        a new request needs no new process.

        Raises:
            LinkError: The ARC did not confirm; release it.
        """
        await self.idle()
        try:
            async with asyncio.timeout(REPLY_TIME_S):
                await self._suspended.wait()
        except TimeoutError:
            raise ReplyTimeout(f"{self.arc} still holds its RCs {REPLY_TIME_S:g} s after the order to rest") from None

    async def want_runtime(self, minimum_runtime_s: float, maximum_runtime_s: float = 0.0) -> None:
        """Request other run times from the next slice on."""
        await self._request(WantRuntime(minimum_runtime_s, maximum_runtime_s))

    async def want_longer(self, until_s: float) -> None:
        """Extend the present slice until this mission time, at most to the maximum run time."""
        await self._request(WantLonger(until_s))

    async def release(self, reason: str = "done") -> None:
        """Give the RCs back and end the ARC. Idempotent."""
        try:
            await self._bus.ask(self.address, Release(reason), Accepted, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s did not answer the release: %s", self.arc, error)
        try:
            await self._bus.ask(PLACER, StopComponent(self.arc, reason), Ended, within_s=START_TIME_S)
        except Refusal as refusal:
            log.info("%s was gone already: %s", self.arc, refusal.detail)

    async def _wake(self) -> bool:
        """Wake a resting ARC, which then sends its request; return False if this is not certain."""
        try:
            await self.idle(False)
        except (LinkError, Refusal) as error:
            log.info("%s does not wake up: %s", self.arc, error)
            return False
        return True

    async def _start_anew(
        self, clock: Clock, kind: str, parameters: dict[str, Any], on_changed: Callable[[], None], give_up_s: float
    ) -> None:
        """Start the ARC; first end an ARC that an earlier life of the owner left behind."""
        while True:
            try:
                await self._bus.ask(PLACER, Start(kind, self.arc, parameters), Started, within_s=START_TIME_S)
                return
            except NameTaken as refusal:
                cause = f"one from before has its name: {refusal.detail}"
                self.wish.missing(cause, clock.now_s())
                on_changed()
                await self._end_leftover()
            except (LinkError, CreatorSilent) as error:
                cause = f"claimed without an answer: {error}"
            except Refusal as refusal:
                if not self.wish.started and clock.now_s() >= give_up_s:
                    raise
                cause = f"it was refused: {refusal.detail}"
            log.info("%s: %s", self.arc, cause)
            pause_s = self.wish.not_started(cause, clock.now_s())
            on_changed()
            await clock.sleep_s(pause_s * clock.rate)

    async def _end_leftover(self) -> None:
        try:
            await self._bus.ask(PLACER, StopComponent(self.arc, "left from before"), Ended, within_s=START_TIME_S)
        except Refusal:  # the placer does not have it: stop it directly
            with contextlib.suppress(LinkError):
                await self._bus.ask(self.address, Stop("left from before"), Stopping, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s: ended without an answer: %s", self.arc, error)

    async def _note_absence(self, monitor: PeerMonitor, clock: Clock, on_changed: Callable[[], None]) -> None:
        """Report the ARC as absent while its token does not stand, also while only the own link may be down."""
        await monitor.wait_risen(1)
        while True:
            await monitor.wait_hidden()
            self.wish.missing("it cannot be reached", clock.now_s())
            on_changed()
            await monitor.wait_there()
            self.wish.placed()
            on_changed()

    async def _agree_after_absence(self, monitor: PeerMonitor) -> None:
        """Ask the ARC for its state whenever its token rises again, because notices may have been lost meanwhile."""
        await monitor.wait_there()
        while True:
            await monitor.wait_risen(monitor.times_risen + 1)
            try:
                state = await self.state()
            except LinkError as error:
                log.info("%s is back and does not answer: %s", self.arc, error)
                continue
            await self._agree(state)

    async def _agree(self, state: ArcState) -> None:
        """Apply the ARC's state as if its notice had arrived."""
        if state.granted and (self.granted is None or self.granted.epochs != state.epochs):
            await self.handle(Resumed(self.arc, state.rcs, state.epochs, -1.0))
        elif self.granted is not None and not state.granted:
            await self.handle(Suspended(self.arc, state.reason, state.by, state.expected_start_s))

    async def _lost(self) -> None:
        if self.granted is not None:
            await self.handle(Suspended(self.arc, "lost", self.arc, -1.0))

    @property
    def epochs(self) -> dict[str, int]:
        """RC → epoch of the present grant; empty without a grant."""
        return self.granted.epochs if self.granted is not None else {}

    def _last_stop(self) -> int:
        return self._stops.number(self.granted.rcs.get("scout", "")) if self.granted is not None else 0

    async def _move(self, command: Drive | Jump) -> Applied:
        try:
            return await self._command(command)
        except EmergencyStopped as stopped:
            self._stops.refused(stopped)
            raise

    async def _command(self, command: Message) -> Applied:
        return await self._bus.ask(self.address, command, Applied, within_s=REPLY_TIME_S)

    async def _request(self, wish: Message) -> None:
        await self._bus.ask(self.address, wish, Accepted, within_s=REPLY_TIME_S)


def claim_parameters(
    owner: str,
    *,
    path: list[PathNode],
    minimum_runtime_s: float,
    maximum_runtime_s: float = 0.0,
    wish: dict[str, str] | None = None,
    features: dict[str, list[str]] | None = None,
    usage: Usage | Sequence[Usage] = DEFAULT_DRIVE_USAGE,
    console: bool = False,
    idle: bool = False,
    stops_at_once: bool = False,
    may_say_not_now: bool = False,
) -> dict[str, Any]:
    """Return the parameters of an ARC for this owner.

    Args:
        owner: Address of the decision process.
        path: Priority path from the mission's root, or of the console alone.
        minimum_runtime_s: Shortest useful time, seconds, above 0.
        maximum_runtime_s: End of extensions; 0: the minimum.
        wish: Kind of RC → name (``{"scout": "scout2"}``); kinds left out: any.
        features: Kind of RC → features it must have (``{"scout": ["camera"]}``).
        usage: Period of commands on the radio; several: one for each kind of command, ``drive`` among them. With a
            kind of its own, ``jump`` or ``transmitter`` is sent soon while ``drive`` has a long period.
        console: True for consoles.
        idle: True: no time is wanted yet.
        stops_at_once: True: the owner needs no time to stop at the end of a slice. Then ``arc_suspending`` is not
            called, and the context switch does not wait for the owner.
        may_say_not_now: True: the owner is asked shortly before the end of each slice that can be extended.

    Raises:
        ValueError: No usage is given, or two usages have the same kind.
    """
    usages = [usage] if isinstance(usage, Usage) else list(usage)
    kinds = {one.kind for one in usages}
    if not usages or len(kinds) < len(usages):
        raise ValueError(f"{owner} claims with usages of the kinds {[one.kind for one in usages]}")
    first, *further = ([one.period_s, one.packet_time_s, one.deadline_s, one.jitter_s, one.kind] for one in usages)
    return {
        "owner": owner,
        "path": [[node.name, node.priority] for node in path],
        "console": console,
        "minimum_runtime_s": minimum_runtime_s,
        "maximum_runtime_s": maximum_runtime_s,
        "wish": wish or {},
        "features": features or {},
        "usage": first,
        "further_usages": further,
        "idle": idle,
        "stops_at_once": stops_at_once,
        "may_say_not_now": may_say_not_now,
    }


async def stop_robot(bus: Bus, robot: str, reason: str, user: str = "") -> StopState:
    """Stop a robot, also one that an ARC holds; nothing moves it until ``lift_stop``, and the holder keeps its grant.

    A stop needs neither grant nor ARC nor RC manager; a second stop keeps the first one's author. For operators only.

    Raises:
        NotFromYou: The component of ``bus`` is no operator.
        LinkError: The robot's RC did not answer; the outcome is unknown.
    """
    return await _ask_robot(bus, robot, EmergencyStop(reason, user))


async def lift_stop(bus: Bus, stop: StopState, user: str = "") -> StopState:
    """Lift the stop of a robot.

    Args:
        bus: Bus of an operator.
        stop: The stop that the operator saw.
        user: Name of the operator, for people.

    Raises:
        OtherStop: A newer stop is in force.
        NotFromYou: The component of ``bus`` is no operator.
        LinkError: The robot's RC did not answer.
    """
    return await _ask_robot(bus, stop.rc, LiftStop(stop.number, user))


async def ask_stop(bus: Bus, robot: str) -> StopState:
    """Return whether an operator's stop is in force on the robot.

    Raises:
        LinkError: The robot's RC did not answer.
    """
    return await _ask_robot(bus, robot, AskStop())


def watch_stops(bus: Bus, listener: Callable[[StopState], None], robot: str = "*") -> Subscription:
    """Call the listener whenever this robot, or any, is stopped or freed."""
    at = f"{Subsystem.RESOURCE_POOL}/{robot}"
    return bus.subscribe(at, Conversation.EVENTS, StopState, lambda heard: listener(heard.body))


async def _ask_robot(bus: Bus, robot: str, question: Message) -> StopState:
    return await bus.ask(address(Subsystem.RESOURCE_POOL, robot), question, StopState, within_s=REPLY_TIME_S)


def notice_arc(notice: ArcNotice) -> str:
    """Return the ARC of a notice, empty if the notice names none."""
    return "" if isinstance(notice, AskBeat) else notice.arc


def arc_name(bus: Bus, kind: str) -> str:
    """Return the name of the owner's ARC of this kind: ``<owner>-<kind>``."""
    return f"{bus.source.rpartition('/')[2]}-{kind}"
