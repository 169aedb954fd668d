"""Recorders that operators started by hand: the launcher reports each one that hangs, until it responds or has ended.

Input: beats and claims (``recorder_beats``). Output: absences and lines for the log. If a recorder ends or is killed,
its claim falls at once. If it hangs, its claim falls only when its link expires, seconds after its last beat.
"""

from __future__ import annotations

import asyncio
import math
import socket
from collections.abc import Callable
from dataclasses import dataclass

from backbone.bus.interface import Bus, Clock
from backbone.component.messages import Absence
from backbone.keys import Conversation
from backbone.launcher.recorder_beats import BEAT_EACH_S, NAME_BEGIN, RecorderBeat
from backbone.naming import Subsystem, claim_address, component_of
from backbone.operating_system.processes import exists
from backbone.printable import printable_all
from backbone.wire import Envelope

LOOK_EACH_S = 0.5  # chosen: half of a beat; seconds of the machine, as all times of this file
SILENT_AFTER_S = 3.0  # chosen: three beats, as in ``recorder_signs``; recording yields to every deciding process
EXPIRED_AFTER_S = 1.5  # chosen: a link expires 2 s after its last message; a closed link ends within 1.5 beats
NAMED_FOR_S = 60.0  # chosen: time to read it; the launcher does not see the end of a process of another host
MOST_KNOWN = 64  # chosen: far more than operators start; a faulty client cannot fill the memory

Event = tuple[str, str]
"""Name of a recorder, and the text to log about it."""


@dataclass(slots=True)
class _Recorder:
    """The state of one recorder.

    Attributes:
        heard_s: Arrival of its last beat.
        fell_s: End of its claim; ``math.inf``: the claim exists.
        is_silent: True if it counts as hung.
    """

    name: str
    beat: RecorderBeat
    heard_s: float
    fell_s: float = math.inf
    is_silent: bool = False


class HandRecorders:
    """All recorders of one mission that operators started by hand.

    Args:
        rate: Mission seconds per second of the machine; all arguments named ``now_s`` are mission time.
        may_exist: Returns whether this process of this host may still be there.
    """

    def __init__(self, rate: float, may_exist: Callable[[str, int], bool]) -> None:
        self._rate, self._may_exist = rate, may_exist
        self._known: dict[str, _Recorder] = {}
        self._looked_s = -math.inf

    def __bool__(self) -> bool:
        """Return whether any recorder is known."""
        return bool(self._known)

    def beat_came(self, source: str, beat: RecorderBeat, now_s: float) -> list[Event]:
        """Record a beat; return what to log."""
        claim, name = claim_address(source, beat.incarnation), component_of(source)
        known = self._known.get(claim)
        if beat.is_last or not name.startswith(NAME_BEGIN):
            self._known.pop(claim, None)
        elif known is not None:
            was_silent, known.is_silent, known.heard_s = known.is_silent, False, now_s
            return [(name, "responds again")] if was_silent else []
        elif len(self._known) < MOST_KNOWN:
            self._known[claim] = _Recorder(name, beat, now_s)
        return []

    def claim_changed(self, claim: str, now_s: float, *, stands: bool) -> None:
        """Record that the claim of a recorder appeared or fell; ignore the claims of other components."""
        if (known := self._known.get(claim)) is not None:
            known.fell_s = math.inf if stands else now_s

    def look(self, now_s: float, *, is_deaf: bool) -> list[Event]:
        """Decide which recorders hang, and forget those that have ended; return what to log.

        Args:
            is_deaf: True if no beat could come, because the hub does not respond or the link to it is down.
        """
        is_deaf = is_deaf or now_s - self._looked_s > (LOOK_EACH_S + BEAT_EACH_S) * self._rate  # or itself was paused
        self._looked_s = now_s
        events: list[Event] = []
        for claim, one in tuple(self._known.items()):
            if is_deaf and not one.is_silent:
                one.heard_s = now_s
                if one.fell_s < math.inf:
                    del self._known[claim]  # either it returns with the hub, or it has ended meanwhile
            elif not one.is_silent and self._hangs(one, now_s):
                one.is_silent = True
                events.append((one.name, f"does not respond; it records to {one.beat.file}"))
            elif self._has_left(one, now_s) and not (one.is_silent and self._is_worth_naming(one, now_s)):
                del self._known[claim]
                left = f"ended without notice; if {one.beat.file} is incomplete, use 'scout-backbone record recover'"
                events.append((one.name, left))
        return events

    def absences(self) -> list[Absence]:
        """Return each recorder that hangs."""
        return [_absence(one) for one in self._known.values() if one.is_silent]

    def _hangs(self, one: _Recorder, now_s: float) -> bool:
        is_late = now_s - one.heard_s > SILENT_AFTER_S * self._rate
        has_expired = one.heard_s + EXPIRED_AFTER_S * self._rate < one.fell_s < math.inf
        return is_late or has_expired

    def _has_left(self, one: _Recorder, now_s: float) -> bool:
        return now_s - one.fell_s >= LOOK_EACH_S * self._rate  # its last beat may come after the fall

    def _is_worth_naming(self, one: _Recorder, now_s: float) -> bool:
        """Return whether a silent recorder whose claim has fallen may still exist."""
        return now_s - one.fell_s < NAMED_FOR_S * self._rate and self._may_exist(one.beat.host, one.beat.pid)


def _absence(one: _Recorder) -> Absence:
    host, pid = one.beat.host, one.beat.pid
    doing = f"its recording stands still, and messages may be missing in {one.beat.file}"
    mend = "then 'scout-backbone record recover' mends its file"
    wake = "Wake it" if host == socket.gethostname() else f"Check the link to {host}. If it is sound, wake the recorder"
    remedy = f"{wake} on {host} by 'kill -CONT {pid}', or 'kill -9 {pid}'; {mend}."
    return Absence(one.name, one.heard_s, "it does not respond", doing, remedy)


class HandRecorderWatch:
    """Subscribes to the beats and claims of a mission's recorders.

    Args:
        is_deaf: Returns whether the hub does not respond.
        changed: Called with a name and a line for people when a recorder hangs, responds again, or was killed.
    """

    def __init__(
        self, bus: Bus, clock: Clock, is_deaf: Callable[[], bool], changed: Callable[[str, str], None]
    ) -> None:
        self._bus, self._clock, self._is_deaf, self._changed = bus, clock, is_deaf, changed
        self._recorders = HandRecorders(clock.rate, _may_exist)
        self._has_link, self._came = True, asyncio.Event()

    def absences(self) -> list[Absence]:
        """Return each recorder that hangs."""
        return self._recorders.absences()

    async def run(self) -> None:
        """Subscribe until cancelled; check for hung recorders only while a recorder is known."""
        hearing = [
            self._bus.watch_link(self._link_changed),
            self._bus.subscribe(f"{Subsystem.BACKBONE}/*", Conversation.BEAT, RecorderBeat, self._beat_came),
            self._bus.watch_alive(f"{Subsystem.BACKBONE}/*/*", self._claim_changed),
        ]
        try:
            while True:
                await self._came.wait()
                self._log(self._recorders.look(self._clock.now_s(), is_deaf=not self._has_link or self._is_deaf()))
                if not self._recorders:
                    self._came.clear()
                await self._clock.sleep_s(LOOK_EACH_S * self._clock.rate)
        finally:
            for one in hearing:
                one.close()

    def _link_changed(self, is_up: bool) -> None:
        self._has_link = is_up
        if not is_up:
            self._log(self._recorders.look(self._clock.now_s(), is_deaf=True))  # all claims fall now

    def _beat_came(self, heard: Envelope[RecorderBeat]) -> None:
        self._log(self._recorders.beat_came(heard.source, printable_all(heard.body), self._clock.now_s()))
        self._came.set()

    def _claim_changed(self, claim: str, stands: bool) -> None:
        self._recorders.claim_changed(claim, self._clock.now_s(), stands=stands)

    def _log(self, events: list[Event]) -> None:
        for name, what in events:
            self._changed(name, what)


def _may_exist(host: str, pid: int) -> bool:
    return host != socket.gethostname() or exists(pid)
