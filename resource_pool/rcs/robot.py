"""Robot: base class of the RCs of robots with a body, reached through a command radio.

Any operator may stop a robot at any time without a grant. A stop bypasses ARC and RC manager, so it needs only robot,
radio and hub. The stop stays in force if this process is restarted.

Source: IROS 2001, section 2; RAM 2002, "Robots for Surveillance and Reconnaissance".
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Mapping
from typing import Any, ClassVar, Generic, TypeVar, cast

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LastStop
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.wire import Envelope, Message
from resource_pool.commands import Command, Halt, SwitchTransmitter
from resource_pool.drivers.interface import ReplyReader, RobotProtocol
from resource_pool.holds import Hold
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied, AskReadings, LoadPacket, NotFromYou, PacketLoaded
from resource_pool.published_motions import AskMotions, PublishedMotions
from resource_pool.rc_parameters import RobotParameters
from resource_pool.resource_controller import ResourceController
from resource_pool.returned_numbers import applied_values, as_declared
from resource_pool.robot_reports import RobotReports
from resource_pool.stop_file import StopFile
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop, EmergencyQuestion, EmergencyStop, GivenBeforeStop, LiftStop, StopState

__all__ = ["RobotParameters", "RobotRc"]

OPERATORS = (f"{Subsystem.UI_CONSOLE}/", f"{Subsystem.BACKBONE}/")
"""Subsystems whose components may stop any robot without a grant, because they act for people."""

RADIO_REPLY_S = 0.5  # chosen: a radio that needs longer for one packet counts as absent


class NoRadio(Refusal):
    """The ARC holds the robot without its command radio."""

    code = "robot.no_radio"
    remedy = "Claim a kind of ARC whose set includes the robot's command radio."


P = TypeVar("P", bound=RobotParameters)


class RobotRc(ResourceController[P], Generic[P]):
    """Encodes commands as packets of the robot's protocol; the radio sends them at the ARC's rate.

    Derive, set ``commands``, and ``reports`` if the protocol is a ``ReplyReader``, and override ``obey``; a command
    with ``moves`` reaches ``obey`` only while no stop is in force. Each applied command is published, and so is a halt
    without a command, because localizers need both.
    """

    parameters_type: ClassVar[type[msgspec.Struct]] = RobotParameters
    driver_kind, driver_field = "robot", "protocol"
    driver_protocol: ClassVar[type] = RobotProtocol
    obeyed: ClassVar[tuple[type[Command], ...]] = (Halt, SwitchTransmitter)
    is_robot = True
    moves_on_s: ClassVar[float] = 0.0
    """Time for which a part of the robot may move on after the end of a hold, mission seconds."""

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        own = EmergencyQuestion | AskMotions | AskReadings
        cls.accepts = cls.accepts | own if cls.accepts is not None else own

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._protocol: RobotProtocol = self.make_driver(
            self.parameters.protocol, judge=functools.partial(as_declared, self.driver_protocol)
        )
        self._radio = (self.parameters.links.get("command_radio") or [""])[0]
        self._halt_at_s: float | None = None
        self._driven = asyncio.Event()
        self._holder: Hold | None = None
        self._moved_until_s = self._born_s + COMMAND_TIMEOUT_S  # its former process may have moved it
        self._at_rest_s = self._born_s + max(self.moves_on_s, COMMAND_TIMEOUT_S)
        self._frequency = ""
        self._timeouts = 0
        self._motions = PublishedMotions(bus, self._born_s, launch.run_directory)
        self._stop_file = StopFile(launch.run_directory, self.name)
        self._latch = StopLatch(self.name, self._stop_file.read())
        self._repeating: asyncio.Task[None] | None = None
        reader = cast("ReplyReader", self._protocol)
        self._reports = RobotReports(
            self.name,
            bus,
            clock,
            reader if hasattr(reader, "read") and self.reports is not None else None,
            alarm_share=self.parameters.battery_alarm_share,
            say=functools.partial(self.publish_event, self.name),
        )

    def resume_stop(self, last: LastStop) -> None:
        """Stay stopped, or not, as the RC's former process, if that one knew of a later stop or lift than this host."""
        if self._latch.resume(last):
            self._keep_stop()

    async def connect(self) -> None:
        """Also subscribe to the robot's replies."""
        await super().connect()
        if self._radio:
            radio, network_id = address(Subsystem.RESOURCE_POOL, self._radio), self.parameters.network_id
            self._reports.listen(radio, network_id)
            await self._motions.ask_before(radio, network_id, RADIO_REPLY_S)

    async def serve(self) -> None:
        """Stop the wheels when no command comes, and end the hold when its lease expires."""
        if self._latch.state.is_stopped:
            self._publish_stop(f"is still stopped (by {self._latch.state.by})")
            self._follow_stop()
        self.start_task(self._halt_when_silent(), "dead man")
        self.start_task(self._reports.publish_when_due(), "readings")
        await super().serve()

    async def connected(self, hold: Hold) -> None:
        """Record the grant under which the robot obeys."""
        self._holder, self._halt_at_s, self._frequency = hold, None, ""

    async def make_safe(self, hold: Hold) -> None:
        """Send no further command; the radio sends the safe packet when the radio is disconnected."""
        self._holder, self._halt_at_s, self._frequency = None, None, ""
        now_s = self.clock.now_s()
        self._at_rest_s = max(now_s + self.moves_on_s, min(self._moved_until_s, now_s + COMMAND_TIMEOUT_S))
        self.cease()
        self._tell_halted(hold)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Also answer operators, because they may stop the robot without a grant."""
        match asked.body:
            case AskStop():
                return self._latch.state
            case AskReadings():
                return self._reports.readings()
            case AskMotions(since_s=since_s):
                return self._motions.since(since_s)
            case EmergencyStop() | LiftStop() if not asked.source.startswith(OPERATORS):
                self.refused_strangers += 1
                self.story.note(self.name, f"{asked.source} was refused: {type(asked.body).__name__}")
                raise NotFromYou(f"{self.name} is stopped and freed by operators, not by {asked.source}")
            case EmergencyStop(reason=reason, user=user):
                return await self._stop_now(user or asked.source, reason, asked.source)
            case LiftStop(number=number, user=user):
                if self._latch.lift(number, user or asked.source, self.clock.now_s()):
                    self._keep_stop()
                    self._follow_stop()
                    lifted = self._latch.state
                    await self._end_stop_packet()  # first, because commands follow the news
                    if self._latch.state == lifted:
                        self._publish_stop(f"may move again (by {lifted.by})")
                return self._latch.state
            case _:
                return await super().answer(asked)

    async def command(self, asked: Envelope[Message]) -> Message:
        """Also publish the applied values, with the resulting motion."""
        done = await super().command(asked)
        if isinstance(done, Applied):
            motion = applied_values(self.motion_of(done.values), done.command, self.motion_of)
            self._motions.publish(msgspec.structs.replace(done, values=done.values | motion))
        return done

    def permit(self, order: Command) -> None:
        """Refuse motion while a stop is in force, or if the sender did not know the last stop."""
        if order.moves:
            self._latch.require_moving(order.after_stop)

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Halt, or switch the transmitter."""
        match order:
            case Halt():
                await self.halt(hold)
                self._stands(hold)
                return {}
            case SwitchTransmitter(on=on, frequency=frequency):
                packet = self._protocol.transmitter(on, frequency)
                self._frequency = frequency if on else ""
                still = self._protocol.halt()  # repeated, to keep the robot running
                await self._load(hold, packet, at_once=True, afterwards=still, kind="transmitter")
                return {"on": float(on)}
            case _:
                return await super().obey(hold, order)

    async def halt(self, hold: Hold) -> None:
        """Bring the robot to rest. When: at ``Halt``, and if commands stop. Override if one packet does not suffice."""
        await self._load(hold, self._protocol.halt())

    def motion_of(self, values: Mapping[str, float]) -> Mapping[str, float]:  # noqa: ARG002
        """Return ``forward_m_s`` and ``turn_rad_s`` of a command, if the applied values do not contain them.

        When: before an applied command is published. Override if the robot has commands in other quantities.
        """
        return {}

    def cease(self) -> None:
        """Generate no further packets. When: at once at an emergency stop, and at the end of a hold."""

    async def move(self, hold: Hold, order: Command, packet: bytes, *, is_moving: bool = True) -> None:
        """Repeat a packet that moves the robot, until the next command or for ``COMMAND_TIMEOUT_S``.

        Args:
            packet: In the robot's protocol.
            is_moving: False: the robot stands still with this packet, so it needs no halt if commands stop.

        Raises:
            EmergencyStopped: The robot was stopped meanwhile, even if the stop is lifted by now; the packet is not
                sent.
        """
        self.watch_silence(is_moving=is_moving)  # first, because the hold may end or the answer may be lost meanwhile
        await self._move(hold, order, packet, lasts_s=COMMAND_TIMEOUT_S, afterwards=self._protocol.halt())

    def watch_silence(self, *, is_moving: bool) -> None:
        """If the robot moves, halt it unless a command follows within ``COMMAND_TIMEOUT_S``."""
        self._halt_at_s = self.clock.now_s() + COMMAND_TIMEOUT_S if is_moving else None
        self._driven.set()

    async def move_once(self, hold: Hold, order: Command, packet: bytes, kind: str, *, goes_on: bool = False) -> None:
        """Send a packet that moves the robot once, in the stream of this kind; raises as ``move``.

        Afterwards the radio repeats a packet that changes nothing, because a repeated drive or halt could cancel the
        motion. With ``goes_on`` the radio continues to repeat the previous packet, because this packet concerns another
        part of the robot.
        """
        as_it_is = b"" if goes_on else self._protocol.transmitter(bool(self._frequency), self._frequency)
        await self._move(hold, order, packet, at_once=True, afterwards=as_it_is, kind=kind)
        if not goes_on:
            self._stands(hold)

    def stop_packet(self) -> bytes:
        """Return the packet of an operator's stop; override if a halt does not stop all parts of the robot."""
        return self._protocol.halt()

    def statistics(self) -> dict[str, float]:
        """Also count halts for lack of commands, emergency stops and replies."""
        own = {"command_timeouts": self._timeouts, "emergency_stops": float(self._latch.state.number)}
        return {**super().statistics(), **own, **self._reports.statistics()}

    async def _stop_now(self, by: str, reason: str, console: str) -> StopState:
        """Refuse all further motion, and stop the wheels if a holder may be turning them."""
        was = self._latch.state
        is_new = self._latch.stop(by, reason, self.clock.now_s(), console)
        self._latch.confirm(was.is_stopped and was.is_confirmed)
        self._keep_stop()
        self._halt_at_s = None
        self.cease()
        await self._try_stop()
        self._publish_stop(f"was stopped{f': {reason}' if reason else ''} (by {by})" if is_new else "")
        self._follow_stop()
        return self._latch.state

    async def _try_stop(self) -> None:
        """Confirm the stop if the radio accepts its packet, or if no packet of a former holder moves the robot soon."""
        holder, number = self._holder, self._latch.state.number
        if holder is None:
            # A former holder's last packet was a safe one, or the radio was late, or sends no more.
            until_s = min(self._at_rest_s, self.clock.now_s() + RADIO_REPLY_S * self.clock.rate)
            await self.clock.sleep_until_s(until_s)
            self._latch.confirm(self._at_rest_s <= until_s, number)  # not by the clock: a wait may end a little early
            return
        try:
            await self._load(holder, self.stop_packet())
        except (Refusal, LinkError) as error:  # the robot halts by itself when its last drive expires
            self.story.note(holder.arc, f"the stop was not sent: {error}")
            self._latch.confirm(False, number)
        else:
            self._latch.confirm(True, number)
            self._tell_halted(holder)

    def _follow_stop(self) -> None:
        """Repeat the stop in force until it is confirmed; repeat no earlier stop."""
        if self._repeating is not None:
            self._repeating.cancel()
        if not self._latch.state.is_confirmed:
            self._repeating = self.start_task(self._repeat_stop(), "repeat stop")

    async def _repeat_stop(self) -> None:
        """Publish that the stop is confirmed as soon as it is; a radio gets it at most every ``RADIO_REPLY_S``."""
        while not self._latch.state.is_confirmed:
            if self._holder is not None:
                await self.clock.sleep_s(RADIO_REPLY_S * self.clock.rate)
            await self._try_stop()
        self._publish_stop("has confirmed its stop")

    async def _end_stop_packet(self) -> None:
        """Repeat a halt from now on: repeated stop packets would stop a part that moves beside the wheels again."""
        if (holder := self._holder) is None:
            return
        try:
            await self._load(holder, self._protocol.halt())
        except (Refusal, LinkError) as error:  # the next motion of the wheels replaces the stop packet
            self.story.note(holder.arc, f"the stop packet is still repeated: {error}")

    def last_stop(self) -> LastStop:
        """Return the last stop, for the published state."""
        return self._latch.last()

    def _tell_halted(self, hold: Hold) -> None:
        """Publish that the robot was halted without a command."""
        self._motions.publish(Applied(self.name, hold.epoch, self.clock.now_s(), Halt.word()))

    def _publish_stop(self, news: str) -> None:
        """Publish the stop, and news if any, before its operator has the answer: this host may die the next moment."""
        self.publish_news()  # the nameserver keeps the stop for an RC on another host
        self.bus.publish(self.address, Conversation.EVENTS, self._latch.state)
        if news:
            self.publish_event(self.name, news)

    def _keep_stop(self) -> None:
        """Save the stop for the next process of this RC; a write error must not prevent the stop."""
        try:
            self._stop_file.write(self._latch.state)
        except OSError as error:
            news = "is stopped" if self._latch.state.is_stopped else "is free again"
            self.publish_event(
                self.name, f"a restart of this RC will not know that {self.name} {news}: {error.strerror}"
            )

    def _stands(self, hold: Hold) -> None:
        """Record that the robot stands still, unless another ARC holds it by now."""
        if self._holder is not None and self._holder.epoch == hold.epoch:
            self._halt_at_s = None

    async def _move(self, hold: Hold, order: Command, packet: bytes, **how: Any) -> None:
        self.permit(order)  # again, because ``obey`` may have waited since
        self._moved_until_s = self.clock.now_s() + 2 * COMMAND_TIMEOUT_S  # repeated, and obeyed for so long each
        try:
            await self._load(hold, packet, moves=True, **how)
        except GivenBeforeStop:
            self._latch.require_moving(order.after_stop)
            raise

    async def _load(
        self,
        hold: Hold,
        payload: bytes,
        *,
        at_once: bool = False,
        afterwards: bytes = b"",
        lasts_s: float = 0.0,
        kind: str = "drive",
        moves: bool = False,
    ) -> None:
        epoch = hold.companions.get(self._radio)
        if epoch is None:
            raise NoRadio(f"{hold.arc} holds {self.name} without {self._radio or 'a radio'}")
        order = LoadPacket(
            hold.arc,
            epoch,
            self.parameters.network_id,
            payload,
            self._protocol.safe(),
            hold.epoch,
            at_once,
            afterwards,
            lasts_s,
            kind,
            moves,
            self._latch.state.number,
            self._reports.are_read,
        )
        radio = address(Subsystem.RESOURCE_POOL, self._radio)
        await self.bus.ask(radio, order, PacketLoaded, within_s=RADIO_REPLY_S)

    async def _halt_when_silent(self) -> None:
        """Dead-man's control: a drive command without a repetition ends after ``COMMAND_TIMEOUT_S``."""
        while True:
            self._driven.clear()
            if self._halt_at_s is None:
                await self._driven.wait()
                continue
            await self.clock.sleep_until_s(self._halt_at_s)
            hold = self._holder
            if not self._silent_too_long():
                continue
            self._halt_at_s = None
            if hold is None:
                continue
            self._timeouts += 1
            self.story.note(hold.arc, "sent no command for too long: the robot was halted")
            try:
                await self.halt(hold)
            except (Refusal, LinkError) as error:  # swapped out, or no radio: the safe packet or the robot itself halts
                self.story.note(hold.arc, f"halt not sent: {error}")
            else:
                self._tell_halted(hold)

    def _silent_too_long(self) -> bool:
        """Return whether no command has arrived during the sleep."""
        return self._halt_at_s is not None and self.clock.now_s() >= self._halt_at_s
