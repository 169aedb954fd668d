"""The client interface of the resource pool: decision processes import nothing else of it.

A decision process (behavior or console) claims an ARC, gets a notice at the begin and end of each grant, and sends
commands during a grant. The ARC refuses commands outside a grant.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping

import msgspec

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.messages import Stopper
from backbone.errors import LinkError, Refusal, ReplyTimeout
from backbone.keys import Conversation
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import Ended, StopComponent
from backbone.placer.wishes import Wish
from backbone.rc_manager.messages import StaleEpoch
from backbone.scheduling.requests import PathNode, Usage
from backbone.wire import Envelope, Message, UnknownMessage
from resource_pool.arc_keeper import REPLY_TIME_S, START_TIME_S, ArcKeeper
from resource_pool.arc_listener import ArcListener, NotMyArc
from resource_pool.arc_request import ROBOT, claim_parameters
from resource_pool.commands import Command, Drive, Halt, Jump, Move, WrongCommand
from resource_pool.localization import (
    AskFloorPlan,
    AskHome,
    AskPose,
    FloorPlan,
    FloorShape,
    LandmarkSighting,
    Pose,
    PoseSource,
    ShapeKind,
)
from resource_pool.messages import (
    DEFAULT_DRIVE_USAGE,
    Accepted,
    Applied,
    ArcNotice,
    ArcState,
    AskArc,
    AskBeat,
    Frame,
    GiveCommand,
    NoSuchAction,
    Noted,
    Readings,
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
from resource_pool.rc_readings import ask_readings, watch_readings
from resource_pool.robot_stops import ask_stop, lift_stop, stop_robot, watch_stops
from resource_pool.stop_knowledge import StopKnowledge
from resource_pool.stop_messages import EmergencyStopped, GivenBeforeStop, OtherStop, StopState

__all__ = [
    "DEFAULT_DRIVE_USAGE",
    "ROBOT",
    "Applied",
    "ArcClient",
    "ArcListener",
    "ArcNotice",
    "ArcState",
    "AskBeat",
    "AskFloorPlan",
    "AskHome",
    "AskPose",
    "Command",
    "EmergencyStopped",
    "FloorPlan",
    "FloorShape",
    "Frame",
    "GivenBeforeStop",
    "Halt",
    "Jump",
    "LandmarkSighting",
    "NoSuchAction",
    "NotMyArc",
    "Noted",
    "OtherStop",
    "PathNode",
    "Pose",
    "PoseSource",
    "Readings",
    "Resumed",
    "ShapeKind",
    "SliceEnds",
    "StaleEpoch",
    "StopState",
    "Stopper",
    "Suspended",
    "Suspending",
    "SwappedOut",
    "Usage",
    "WrongCommand",
    "arc_name",
    "ask_readings",
    "ask_stop",
    "claim_parameters",
    "lift_stop",
    "notice_arc",
    "stop_robot",
    "watch_readings",
    "watch_stops",
    "word_of",
]

log = logging.getLogger(__name__)


class ArcClient:
    """A decision process's client of one ARC, named ``arc_name(bus, kind)``; ``keep`` claims it.

    Its component passes each ``ArcNotice`` question to ``handle``, also while the ARC is still starting.
    """

    def __init__(self, bus: Bus, arc: str, listener: ArcListener, not_now: Callable[[], float] | None = None) -> None:
        """Create a client that claims no ARC yet.

        Args:
            bus: Bus of the decision process.
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
        self._stops = StopKnowledge()

    async def keep(
        self,
        clock: Clock,
        kind: str,
        parameters: dict[str, object],
        *,
        rests: bool = False,
        is_there: bool = False,
        patience_s: float = 0.0,
        on_changed: Callable[[], None] = lambda: None,
    ) -> None:
        """Claim the ARC, and claim it again whenever it is gone, until cancelled.

        If a grant ends with its ARC, the listener gets ``arc_suspended`` with the reason ``lost``.

        Args:
            kind: Component type of the ARC: ``drive``, ``video_drive``, ``capture``.
            parameters: Made by ``claim_parameters``.
            rests: True: the ARC was started with these parameters before and rests. ``keep`` wakes it, and starts it
                again only if it is gone.
            is_there: True: this owner has claimed the ARC before; ``keep`` claims it again only if it is gone.
            patience_s: Time during which a refused first start is retried, in machine seconds: a host may be
                restarting, or the ARC of an earlier process may be ending.
            on_changed: Called when ``wish.absence()`` may have changed.

        Raises:
            Refusal: The ARC did not start, or its request can never be served.
        """
        keeper = ArcKeeper(self._bus, self.arc, self.wish, self, clock, on_changed)
        await keeper.keep(kind, parameters, rests=rests, is_there=is_there, patience_s=patience_s)

    async def answer(self, asked: Envelope[Message]) -> Noted:
        """Handle a notice that comes from the claimed ARC.

        Raises:
            NotMyArc: It comes from another component, or is no notice.
        """
        if asked.source != self.address or not isinstance(asked.body, ArcNotice):
            raise NotMyArc(f"{asked.source} is not claimed here, {self.arc} is", arc=component_of(asked.source))
        return await self.handle(asked.body)

    async def handle(self, notice: ArcNotice) -> Noted:
        """Record a notice of the ARC and call the listener; return the reply to the ARC."""
        match notice:
            case Resumed():
                if self.granted is not None and self.granted.epochs == notice.epochs:
                    if notice.until_s > self.granted.until_s:
                        self.granted = notice
                    return Noted()  # repeated: the first answer was lost, or a heartbeat was earlier
                await self.lost()
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
                    await self.agree(state)
        return Noted()

    async def wait_granted(self) -> Resumed:
        """Wait until the RCs are granted."""
        while self.granted is None:
            await self._granted.wait()
        return self.granted

    async def command(self, command: Command) -> Applied:
        """Send a command to the RC of its role; return what the RC applied.

        Raises:
            SwappedOut: The ARC has no grant; the RC did not get the command.
            NoSuchAction: This kind of ARC has no such command.
            EmergencyStopped: The command moves the robot, and an operator has stopped it, or stopped it between the
                last command and this one.
        """
        if command.moves:
            command = msgspec.structs.replace(command, after_stop=self._last_stop())
        try:
            return await self._ask(command)
        except UnknownMessage as unknown:
            if "schema" not in unknown.facts:  # the RC refused it, not the ARC
                raise
            raise NoSuchAction(f"{self.arc} has no command {command.word()}", command=command.word()) from unknown

    async def give(self, word: str, values: Mapping[str, object], role: str = "") -> Applied:
        """Send the command that has this word; see ``command``.

        Raises:
            WrongCommand: The values do not fit the command's fields.
        """
        return await self._ask(GiveCommand(word, dict(values), role, self._last_stop()))

    async def move(self, forward_m_s: float, turn_rad_s: float = 0.0) -> Applied:
        """Move forward, and turn left; see ``command``."""
        return await self.command(Move(forward_m_s, turn_rad_s))

    async def drive(self, left_rad_s: float, right_rad_s: float) -> Applied:
        """Turn the wheels; return the speeds that were applied after clipping; see ``command``."""
        return await self.command(Drive(left_rad_s, right_rad_s))

    async def halt(self) -> Applied:
        """Stop all motion; see ``command``."""
        return await self.command(Halt())

    async def jump(self) -> Applied:
        """Jump; see ``command``."""
        return await self.command(Jump())

    def heard_stop(self, state: StopState) -> bool:
        """Record that a robot was stopped or freed; return whether this is news.

        The next command counts as given with knowledge of the stop, so show the stop to a person before.
        """
        return self._stops.heard(state)

    def frames(self, listener: Callable[[Frame], None], camera: str = "") -> Subscription:
        """Call the listener with the newest picture of the present grant; pictures of earlier grants never arrive.

        Args:
            listener: Called in the event loop.
            camera: Role of a further camera of the ARC; empty: the camera of its robot.
        """

        def arrived(envelope: Envelope[Frame]) -> None:
            frame = envelope.body
            if self.granted is not None and self.granted.epochs.get(frame.rc) == frame.epoch:
                listener(frame)

        at = f"{self.address}/{camera}" if camera else self.address
        return self._bus.subscribe(at, Conversation.FRAMES, Frame, arrived, latest=True)

    async def wait_stop_lifted(self, robot: str) -> None:
        """Wait until no operator's stop is in force on this robot.

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
        """Return the RCs and keep the ARC process; the ARC requests no time until ``keep`` with ``rests``.

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
        """Return the RCs and end the ARC. Idempotent."""
        try:
            await self._bus.ask(self.address, Release(reason), Accepted, within_s=REPLY_TIME_S)
        except (LinkError, Refusal) as error:
            log.info("%s did not release its RCs, and is stopped: %s", self.arc, error)
        try:
            await self._bus.ask(PLACER, StopComponent(self.arc, reason), Ended, within_s=START_TIME_S)
        except Refusal as refusal:
            log.info("%s was gone already: %s", self.arc, refusal.detail)

    async def agree(self, state: ArcState) -> None:
        """Apply the ARC's state as if its notice had arrived."""
        if state.granted and (self.granted is None or self.granted.epochs != state.epochs):
            await self.handle(Resumed(self.arc, state.rcs, state.epochs, -1.0, state.robot))
        elif self.granted is not None and not state.granted:
            await self.handle(Suspended(self.arc, state.reason, state.by, state.expected_start_s))

    async def lost(self) -> None:
        """End the grant, because its ARC is gone."""
        if self.granted is not None:
            await self.handle(Suspended(self.arc, "lost", self.arc, -1.0))

    @property
    def epochs(self) -> dict[str, int]:
        """RC → epoch of the present grant; empty without a grant."""
        return self.granted.epochs if self.granted is not None else {}

    def _last_stop(self) -> int:
        return self._stops.number(self.granted.robot) if self.granted is not None else 0

    async def _ask(self, command: Message) -> Applied:
        try:
            return await self._bus.ask(self.address, command, Applied, within_s=REPLY_TIME_S)
        except EmergencyStopped as stopped:
            self._stops.refused(stopped)
            raise

    async def _request(self, wish: Message) -> None:
        await self._bus.ask(self.address, wish, Accepted, within_s=REPLY_TIME_S)


def notice_arc(notice: ArcNotice) -> str:
    """Return the ARC of a notice, empty if the notice names none."""
    return "" if isinstance(notice, AskBeat) else notice.arc


def arc_name(bus: Bus, kind: str) -> str:
    """Return the name of the owner's ARC of this kind: ``<owner>-<kind>``."""
    return f"{bus.source.rpartition('/')[2]}-{kind}"


def word_of(asked: Message) -> str:
    """Return the word of a command to an ARC, whether it is sent by its class or by its word; empty: it is none."""
    if isinstance(asked, GiveCommand):
        return asked.word
    return asked.word() if isinstance(asked, Command) else ""
