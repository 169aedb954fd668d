"""Reports of one robot: decodes its replies, publishes its readings, watches its battery.

A reply that cannot be decoded, or has a value out of range, is counted and otherwise ignored. ``WRONG_IN_A_ROW`` of
these make one event, and ``RIGHT_IN_A_ROW`` good replies afterwards another one. A number that no message can carry,
such as the infinite distance of a sonar without an echo, is left out of the readings; the others stay.
"""

from __future__ import annotations

import asyncio
from typing import Protocol

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.messages import LogLevel
from backbone.keys import Conversation
from backbone.ranges import MOST_MEASURE
from backbone.wire import Envelope
from resource_pool.drivers.interface import MalformedReply, ReplyReader
from resource_pool.messages import Readings, Reply
from resource_pool.readings_book import EVERY_S, BatteryWatch, Charge, ReadingsBook

WRONG_IN_A_ROW = 3  # chosen: noise that passes the check of a packet does not come three times
RIGHT_IN_A_ROW = 30  # chosen: three seconds at ten packets a second, so that a mixture makes one event
BATTERY = "battery_share"
"""Field of a robot's reports with the charge of its battery, 0 to 1."""


class Say(Protocol):
    """Publishes an event about the robot."""

    def __call__(self, what: str, level: LogLevel) -> None:
        """Publish it."""


class RobotReports:
    """Receives the replies of one robot from its radio."""

    def __init__(
        self, rc: str, bus: Bus, clock: Clock, reader: ReplyReader | None, *, alarm_share: float, say: Say
    ) -> None:
        """Create the reports without a subscription.

        Args:
            rc: Name of the robot's RC.
            reader: The robot's protocol; None: the protocol cannot decode replies.
            alarm_share: Charge of the battery below which there is an alarm.
            say: Publishes an event about the robot.
        """
        self._rc, self._bus, self._clock, self._reader, self._say = rc, bus, clock, reader, say
        self._book = ReadingsBook(EVERY_S * max(1.0, clock.rate))
        self._battery = BatteryWatch(alarm_share)
        self._news = asyncio.Event()
        self._read = self._malformed = self._wrong_in_a_row = self._right_in_a_row = 0
        self._is_told = False

    @property
    def are_read(self) -> bool:
        """True if the robot's protocol can decode replies."""
        return self._reader is not None

    def listen(self, radio: str, network_id: int) -> None:
        """Decode the replies of this network id from now on.

        Args:
            radio: Address of the robot's radio.
        """
        reader = self._reader
        if reader is None:
            return

        def heard(envelope: Envelope[Reply]) -> None:
            if envelope.source == radio and envelope.body.network_id == network_id:
                self._take(reader, envelope.body.payload)

        self._bus.subscribe(radio, Conversation.REPLIES, Reply, heard)

    async def publish_when_due(self) -> None:
        """Publish the newest readings each time they are due."""
        while True:
            self._news.clear()
            due_s = self._book.due_s
            if due_s is None:
                await self._news.wait()
                continue
            await self._clock.sleep_until_s(due_s)
            now_s, due_s = self._clock.now_s(), self._book.due_s
            if due_s is not None and due_s <= now_s:
                self._bus.publish(self._bus.source, Conversation.READINGS, self.readings())
                self._book.published(now_s)

    def readings(self) -> Readings:
        """Return the newest readings."""
        return Readings(self._rc, self._book.at_s, dict(self._book.values))

    def statistics(self) -> dict[str, float]:
        """Count replies."""
        return {"replies_read": self._read, "replies_malformed": self._malformed}

    def _take(self, reader: ReplyReader, payload: bytes) -> None:
        try:
            report = _checked(reader.read(payload))
        except MalformedReply as error:
            self._malformed += 1
            self._count_wrong(error.detail)
            return
        self._read += 1
        self._count_right()
        fields = msgspec.structs.asdict(report)
        numbers = {name: value for name, value in fields.items() if isinstance(value, bool | int | float)}
        values = {name: value for name, value in numbers.items() if abs(value) <= MOST_MEASURE}  # not nan, see ranges
        self._book.put(values, self._clock.now_s())
        self._news.set()
        if BATTERY in values:
            self._watch_battery(values[BATTERY])

    def _count_wrong(self, why: str) -> None:
        self._wrong_in_a_row, self._right_in_a_row = self._wrong_in_a_row + 1, 0
        if self._wrong_in_a_row >= WRONG_IN_A_ROW and not self._is_told:
            self._is_told = True
            self._say(f"its replies cannot be decoded: {why}; {MalformedReply.remedy}", LogLevel.WARNING)

    def _count_right(self) -> None:
        self._wrong_in_a_row, self._right_in_a_row = 0, self._right_in_a_row + 1
        if self._right_in_a_row >= RIGHT_IN_A_ROW and self._is_told:
            self._is_told = False
            self._say("its replies can be decoded again", LogLevel.NOTICE)

    def _watch_battery(self, share: float) -> None:
        match self._battery.see(share):
            case Charge.LOW:
                self._say(f"its battery is low: {share:.0%} left", LogLevel.ALARM)
            case Charge.CHARGED_AGAIN:
                self._say(f"its battery is charged again: {share:.0%}", LogLevel.NOTICE)
            case Charge.AS_BEFORE:
                pass


def _checked(report: object) -> msgspec.Struct:
    """Return what a protocol has read.

    Raises:
        MalformedReply: It is no struct, or one of its values is of another type than declared, or out of range.
    """
    if not isinstance(report, msgspec.Struct):
        raise MalformedReply(f"read of the robot's protocol returns {report!r:.40}, no struct")
    try:
        msgspec.convert(msgspec.to_builtins(report), type(report))
    except (msgspec.ValidationError, TypeError) as error:  # a TypeError: no message carries a value of this type
        raise MalformedReply(str(error)) from error
    return report
