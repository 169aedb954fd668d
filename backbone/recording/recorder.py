"""Recorder: writes everything it overhears into a recording.

It is not a component: it answers no questions, and if it is too slow, messages are dropped instead of delayed.
Therefore it delays no component, even if its process hangs. If its file cannot grow, it ends in good order.
"""

from __future__ import annotations

import asyncio
import logging
import shutil
from collections.abc import Callable, Mapping

from backbone.addresses import COMPONENT_DATABASE, RC_MANAGER
from backbone.bus.host_copies import copy_at
from backbone.bus.interface import Bus, Clock, Overhearing, Reply
from backbone.bus.lossless import STILL_COME_S
from backbone.component.messages import (
    AskParameters,
    AskState,
    AskStory,
    ComponentState,
    LogLevel,
    Parameters,
    Story,
    StoryEvent,
)
from backbone.component.mission_time import MissionStart, ask_time
from backbone.component_database.messages import ListTypes, Types
from backbone.errors import LinkError, Refusal
from backbone.keys import ROOT, Conversation
from backbone.keys import key as key_of
from backbone.naming import component_of
from backbone.rc_manager.messages import AskSchedule, AskSnapshot, ScheduleSnapshot
from backbone.recording.absence import LinkAbsence, missing_in
from backbone.recording.files import SPLIT_BYTES, SPLIT_S, RecordingFiles
from backbone.recording.hearing import to_overhear
from backbone.recording.host_ear import EarTaken, HostEar
from backbone.recording.presence import Presence
from backbone.recording.writer import RecordingWriter
from backbone.scheduling.views import Schedule
from backbone.spoken import counted
from backbone.waiting import in_thread_within, set_within
from backbone.wire import WIRE_VERSION, Envelope, Message, write

FLUSH_EACH_S = 0.25  # chosen: a killed recorder may lose half a second, on a busy machine too; seconds of the machine
REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this
OVERHEARD_WITHIN_S = 0.2  # a copy waits 10 ms at its sender and up to 100 ms here; seconds of the machine
MOST_ATTEMPTS = 5  # chosen: together ten times as long
SNAPSHOT_EACH_S = 10.0  # chosen: a replay from the middle must first decide on few earlier events
SNAPSHOT_S_PER_BYTE = 1.5e-4  # measured: a kilobyte is written in 0.15 ms; snapshots take a thousandth of the time
GONE_AFTER_S = 5.0  # chosen: a restarted hub is back within two; seconds of the machine
LEAST_FREE_BYTES = 100 * 1000 * 1000  # B-Human's logger: it stops below 100 MB
MOST_WAITING_BYTES = 64 * 1024 * 1024  # chosen: a second of four cameras in color

_ANSWERS = (Conversation.TOLD, Conversation.ASK)
"""Conversations in which copies of an answer arrive: over the bus, and from processes."""

log = logging.getLogger(__name__)


class Recorder:
    """Writes a recording until it ends, or the mission has ended.

    Args:
        bus: Bus of the mission; not closed.
        files: Files of the recording; closed at the end.
        split_s: A file gets no longer than so many seconds of the machine.
        split_bytes: Approximate largest size of a file.
        classes: Known message classes, by schema.
        about: Facts about the mission.
        keys: Patterns of the keys to record, without ``scout/<mission>/``; empty: all.
        mission_xml: The mission file; empty: not known.
        user: The person who records; empty: no person.
        ear: Receives the copies that processes of this host send. None, or taken by another recorder: the recorder
            overhears only the bus.
        is_lossless: True: senders keep every overheard message until it has arrived, even in bursts.
        host_only: True: the recorder writes only these copies, and asks no component. False: it also overhears the
            copies that other processes send by network, which have no pictures.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        *,
        files: RecordingFiles,
        split_s: float = SPLIT_S,
        split_bytes: int = SPLIT_BYTES,
        classes: Mapping[str, type[Message]],
        about: Mapping[str, str],
        keys: tuple[str, ...] = (),
        mission_xml: str = "",
        user: str = "",
        ear: HostEar | None = None,
        host_only: bool = False,
        is_lossless: bool = False,
    ) -> None:
        self._is_lossless = is_lossless
        self._bus, self._clock, self._user = bus, clock, user
        self._files, self._keys = files, keys
        self._ear, self._host_only = ear, host_only and ear is not None
        self._split_s, self._split_bytes = split_s, split_bytes
        self._facts = classes, about, keys, mission_xml
        self._writer, self._before = self._new_writer(), 0
        self._lost: RecordingWriter | None = None
        self._begun_s = clock.now_s()
        self._subscribed: list[Overhearing] = []
        self._present: dict[str, None] = {}
        self._to_ask: dict[str, None] = {}
        self._awaited, self._was_told, self._needs_asking = frozenset[str](), asyncio.Event(), asyncio.Event()
        self._bug: BaseException | None = None
        self._one_at_a_time, self._needs_snapshot, self._ended = asyncio.Lock(), asyncio.Event(), asyncio.Event()
        self._closing: dict[asyncio.Task[None], None] = {}
        self._has_link, self._is_cut_off, self._is_back = True, False, asyncio.Event()
        self._absence, self._has_other_hosts = LinkAbsence(STILL_COME_S if is_lossless else 0.0), False
        self._start, self.was_started_again = MissionStart(float(about.get("start", 0.0))), False
        """True: it ended because a later mission of the same name is up."""
        self.on_flushed: Callable[[], None] = lambda: None
        """Called after each flush; settable."""
        self.deleted = 0
        """Number of messages that were lost because a person deleted the file that was being written."""
        self.full = ""
        """Reason why the file cannot grow; empty: it can."""

    @property
    def written(self) -> int:
        """Number of recorded messages so far, without the deleted ones."""
        return self._before + self._writer.written - self.deleted

    @property
    def dropped(self) -> int:
        """Number of messages that were lost because the recorder was too slow."""
        return sum(each.dropped for each in self._subscribed) + (self._ear.dropped if self._ear is not None else 0)

    @property
    def away_s(self) -> float:
        """Seconds of the machine in which the hub was away, and an unknown number of messages was lost."""
        return self._absence.total_s

    @property
    def why_ended(self) -> str:
        """Return why it ended by itself; empty: by an order, or it records."""
        if self.full or self.was_started_again:
            return self.full or "the mission was started again"
        return "the mission has ended, or its hub cannot be reached" if self._is_cut_off else ""

    def end(self) -> None:
        """End in good order; then ``run`` returns."""
        self._ended.set()

    async def run(self, on_begun: Callable[[], None] = lambda: None) -> None:
        """Record until the end; afterwards the file is complete, unless the disc is full.

        Args:
            on_begun: Called when the recorder has subscribed.

        Raises:
            BaseException: A bug that ended the recorder.
        """
        self._bus.on_bug = self._fail
        if self._ear is not None:
            await self._open_ear(self._ear)
        if not self._host_only:
            await self._overhear()
        self._bus.watch_link(self._link_changed)
        self._say(f"{self._who} records the mission to {self._files.path.name}", LogLevel.NOTICE)
        on_begun()
        asking = asyncio.create_task(self._ask(), name="what was said before")
        comparing = asyncio.create_task(self._end_with_mission(), name="a later mission")
        try:
            await self._flush_until_end()
        finally:
            asking.cancel()
            comparing.cancel()
            await asyncio.wait({asking, comparing})
            await self._hear_the_last()
            await asyncio.gather(*self._closing)
            if self._ear is not None:
                await self._ear.close()
            self._finish()
        for each in (asking, comparing):
            if not each.cancelled():
                each.result()
        if self._bug is not None:
            raise self._bug

    async def _open_ear(self, ear: HostEar) -> None:
        ear.on_lack = lambda what: self._say(f"{self._who} {what}", LogLevel.WARNING)
        try:
            await ear.open(self._heard, self._fail)
        except (EarTaken, OSError) as error:
            if self._host_only:
                raise
            log.info("overhears the bus: %s", error)
            self._ear = None

    async def _overhear(self) -> None:
        if self._ear is not None:
            self._subscribed.append(self._bus.overhear(Conversation.FAR, self._heard_far, MOST_WAITING_BYTES))
        else:
            # Senders learn of one conversation after the other, so some of their first messages are not sent here.
            settles_s = OVERHEARD_WITHIN_S * self._clock.rate
            self._writer.begin_at(self._clock.now_s() + settles_s)
            for conversation in to_overhear(self._keys):
                self._subscribed.append(
                    self._bus.overhear(conversation, self._heard, MOST_WAITING_BYTES, lossless=self._is_lossless)
                )
            await self._clock.sleep_s(settles_s)
        self._bus.watch_alive("*/*", self._alive_changed)

    async def _flush_until_end(self) -> None:
        dropped, silent_s = 0, 0.0
        while not self._ended.is_set() and not self.full:
            await self._clock.sleep_s(FLUSH_EACH_S * self._clock.rate)
            self._flush()
            self.on_flushed()
            news = self.dropped - dropped
            if news:
                self._say(f"{counted(news, 'message')} came too fast to be recorded", LogLevel.WARNING)
                dropped += news
            silent_s = 0.0 if self._has_link else silent_s + FLUSH_EACH_S
            if silent_s > GONE_AFTER_S:
                self._is_cut_off = True
                self.end()

    def _flush(self) -> None:
        if self._ear is not None:
            self._ear.hear()
        try:
            self._writer.flush()
            if shutil.disk_usage(self._files.path.parent).free < LEAST_FREE_BYTES:
                self._fill(f"less than {LEAST_FREE_BYTES // 1_000_000} MB are free")
            elif self._note_deletion() or self._is_long:
                self._split()
        except OSError as error:
            self._fill(error)

    @property
    def _is_long(self) -> bool:
        lasted_s = (self._clock.now_s() - self._begun_s) / self._clock.rate
        return lasted_s >= self._split_s or self._files.file.tell() >= self._split_bytes

    def _note_deletion(self) -> bool:
        """Return whether the open file was deleted; if so, count its messages as lost, and log it, once a file."""
        if self._lost is self._writer or not self._files.is_deleted:
            return False
        self._lost = self._writer
        self.deleted += self._writer.written
        lost = f"{self._files.path.name} was deleted while it was recorded to"
        self._say(f"{lost}; {counted(self._writer.written, 'message')} are lost", LogLevel.ALARM)
        return True

    def _split(self) -> None:
        self._writer.finish()
        closing = asyncio.create_task(self._close(self._files.open_next()), name="closes a file")
        self._closing[closing] = None
        closing.add_done_callback(self._closing.pop)
        self._before, self._begun_s = self._before + self._writer.written, self._clock.now_s()
        self._writer = self._new_writer()
        self._needs_snapshot.set()
        for address in tuple(self._present):  # each file states the present components and their states
            self._alive_changed(address, alive=True)

    async def _close(self, close: Callable[[], None]) -> None:
        """Close a file in a thread, because a slow disc takes seconds for it, and meanwhile messages arrive."""
        try:
            await in_thread_within(close, None)
        except OSError as error:
            self._fill(error)

    def _new_writer(self) -> RecordingWriter:
        return RecordingWriter(self._files.file, *self._facts)

    async def _hear_the_last(self) -> None:
        """Return when the copies of all messages sent until now have arrived; they are the end of the file."""
        self._writer.end_at(self._clock.now_s())
        if self._has_link:
            await self._clock.sleep_s(OVERHEARD_WITHIN_S * self._clock.rate)

    def _finish(self) -> None:
        for subscribed in self._subscribed:
            subscribed.close()
        try:
            self._writer.finish()
            self._note_deletion()
            self._files.close()
        except OSError as error:
            self._fill(error)
        self._say(f"{self._who} records no more{f': {self.full}' if self.full else ''}", LogLevel.NOTICE)

    def _fail(self, bug: BaseException) -> None:
        self._bug = self._bug or bug
        self.end()

    def _fill(self, why: str | OSError) -> None:
        self.full = self.full or (why if isinstance(why, str) else why.strerror or str(why))

    def _link_changed(self, is_up: bool) -> None:
        if is_up and not self._has_link:
            self._is_back.set()
        self._has_link = is_up
        if self._ear is None or self._has_other_hosts:  # processes of this host send their copies without a hub
            away_s = self._absence.changed(is_up, self._clock.now_s() / self._clock.rate)
            if away_s:
                self._say(f"{self._who}: {missing_in(away_s)}", LogLevel.WARNING)

    async def _end_with_mission(self) -> None:
        """End if a later mission of the same name is up after a loss of the link; write none of its messages then."""
        while not self.was_started_again:
            await self._is_back.wait()
            self._is_back.clear()
            heard = await ask_time(self._bus, self._clock)
            self.was_started_again = self._start.is_over(heard)
            if not self.was_started_again:
                self._start.follow(heard, self._clock)
        self.end()

    def _alive_changed(self, address: str, alive: bool) -> None:
        now_s = self._clock.now_s()
        raw = write(Envelope(WIRE_VERSION, "", 0, now_s, "", Presence(alive)))
        self._heard(key_of(self._bus.mission, address, Conversation.ALIVE), raw)
        if alive:
            self._present[address] = self._to_ask[address] = None
            self._needs_asking.set()
        else:
            self._present.pop(address, None)

    @property
    def _who(self) -> str:
        return self._user or component_of(self._bus.source)

    def _say(self, what: str, level: LogLevel) -> None:
        event = StoryEvent(self._clock.now_s(), self._bus.source, what, "recording", "", level, self._user)
        self._bus.publish(self._bus.source, Conversation.LOG, event)

    def _heard_far(self, at: str, raw: bytes) -> None:
        self._has_other_hosts = True
        end, own = 0, f"{ROOT}/{self._bus.mission}/"
        try:
            while (copy := copy_at(raw, end)) is not None:
                end = copy.end
                if copy.key.startswith(own):  # any process may publish at this key
                    self._heard(copy.key, copy.raw)
        except (ConnectionError, UnicodeDecodeError) as error:
            log.warning("no copies at %s: %s", at, error)

    def _heard(self, key: str, raw: bytes) -> None:
        if key in self._awaited:
            self._was_told.set()
        if self.full or self.was_started_again:
            return
        try:
            self._writer.write(key, raw, self._clock.now_s())
        except OSError as error:
            self._fill(error)

    async def _ask(self) -> None:
        """Ask for states from before the begin; the answers are overheard like all others."""
        if not self._host_only and Conversation.TOLD in to_overhear(self._keys):
            await asyncio.gather(self._ask_for_snapshots(), self._ask_who_appears())

    async def _ask_for_snapshots(self) -> None:
        """Ask for the state of the schedule repeatedly, and at the begin of each file."""
        while True:
            self._needs_snapshot.clear()
            answer = await self._asked(RC_MANAGER, AskSnapshot(), ScheduleSnapshot)
            size_bytes = len(answer.state) if answer is not None else 0
            await set_within(self._needs_snapshot, max(SNAPSHOT_EACH_S, size_bytes * SNAPSHOT_S_PER_BYTE))

    async def _ask_who_appears(self) -> None:
        while True:
            while not self._to_ask:
                self._needs_asking.clear()
                await self._needs_asking.wait()
            address = next(iter(self._to_ask))
            del self._to_ask[address]
            if address == RC_MANAGER:
                self._needs_snapshot.set()
                await self._asked(address, AskSchedule(), Schedule)
            if address == COMPONENT_DATABASE:
                await self._asked(address, ListTypes(), Types)
            if await self._asked(address, AskState(), ComponentState) is not None:  # else it has ended meanwhile
                await self._asked(address, AskParameters(), Parameters)
                await self._asked(address, AskStory(), Story)

    async def _asked(self, address: str, question: Message, reply: type[Reply]) -> Reply | None:
        """Return the answer after it was overheard too; None: no answer came."""
        async with self._one_at_a_time:
            self._awaited = frozenset(key_of(self._bus.mission, address, one) for one in _ANSWERS)
            for _attempt in range(MOST_ATTEMPTS):
                self._was_told.clear()
                try:
                    answer = await self._bus.ask(address, question, reply, within_s=REPLY_TIME_S)
                except (LinkError, Refusal) as error:
                    log.info("%s is not in the recording: %s", address, error)
                    return None
                if await set_within(self._was_told, OVERHEARD_WITHIN_S):
                    break
            return answer
