"""Outbox of one browser: holds only the newest message of each kind.

Rules of this file: no socket, no clock; times are seconds of the machine.

* There are no queues: a newer picture of a robot, a newer message of a key, or a newer section of the view replaces the
older one.
* At most ``PICTURES_UNDERWAY`` pictures of a robot are in transit; the next is sent when the browser has drawn one. So
a slow link shows few pictures, not old ones.
* All answers to the operator are sent; if there are more than ``ANSWERS_KEPT``, the oldest is dropped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import msgspec

PICTURES_UNDERWAY = 2  # measured: with two, three cameras on 100 kB/s show pictures 0.4 s old, and LANs lose no rate
DRAWN_WITHIN_S = 2.0  # chosen: a picture not drawn by then was lost in a hidden page; another one may be sent
ANSWERS_KEPT = 20  # chosen: more than a person asks before reading


@dataclass(slots=True)
class _PictureStream:
    waiting: tuple[int, float, bytes] | None = None
    underway: dict[int, tuple[float, float]] = field(default_factory=dict)  # number → (sent, captured)
    turn: int = 0


class Outbox:
    """Messages not sent yet to one browser."""

    def __init__(self) -> None:
        self._sections: dict[str, bytes] = {}
        self._unsent: dict[str, None] = {}
        self._answers: deque[bytes] = deque(maxlen=ANSWERS_KEPT)
        self._streams: dict[str, _PictureStream] = {}
        self._robots = frozenset[str]()
        self._view = ""
        self._beside = frozenset[str]()
        self._turns = 0
        self.skipped = 0
        """Pictures that a newer one replaced before they were sent."""

    def put_section(self, name: str, body: bytes) -> None:
        """Queue a section of the view, unless the browser already has it.

        Args:
            name: Of the section.
            body: As JSON.
        """
        if self._sections.get(name) != body:
            self._sections[name] = body
            self._unsent[name] = None

    def put_answer(self, body: bytes) -> None:
        """Queue an answer.

        Args:
            body: A JSON object.
        """
        self._answers.append(body)

    def watch(self, robots: frozenset[str]) -> None:
        """Show exactly these robots' pictures, and the pictures of the watched view."""
        self._robots = robots
        self._keep_streams()

    def look(self, view: str) -> None:
        """Show the pictures of this debug view in addition to those of robots; empty: no view."""
        self._view = view
        self._keep_streams()

    def open_beside(self, streams: frozenset[str]) -> None:
        """Also send the data of these streams; a page confirms each part after drawing, as for a picture."""
        self._beside = streams
        self._keep_streams()

    def _keep_streams(self) -> None:
        names = sorted(self._robots | self._beside | ({self._view} if self._view else set()))
        self._streams = {name: self._streams.get(name) or _PictureStream() for name in names}

    @property
    def watched(self) -> frozenset[str]:
        """Robots whose pictures are shown."""
        return self._robots

    def put_picture(self, robot: str, number: int, captured_s: float, packet: bytes) -> None:
        """Queue a picture, replacing an older one of that robot; if the browser does not watch it, do nothing."""
        stream = self._streams.get(robot)
        if stream is not None:
            self.skipped += stream.waiting is not None
            stream.waiting = (number, captured_s, packet)

    def drawn(self, robot: str, number: int) -> float | None:
        """Record that a picture, and all pictures sent before it, are on the screen.

        Returns:
            Its time of capture; None: no such picture is in transit.
        """
        stream = self._streams.get(robot)
        if stream is None or number not in stream.underway:
            return None
        sent_s, captured_s = stream.underway[number]
        stream.underway = {other: at for other, at in stream.underway.items() if at[0] > sent_s}
        return captured_s

    def next(self, now_s: float) -> str | bytes | None:
        """Return the next message: text, a picture's packet, or None; a returned message counts as sent."""
        if self._answers:
            return self._answers.popleft().decode()
        if self._unsent:
            sections = {name: msgspec.Raw(self._sections[name]) for name in self._unsent}
            self._unsent.clear()
            return msgspec.json.encode({"view": sections}).decode()
        ready = [
            (stream.turn, robot, stream.waiting)
            for robot, stream in self._streams.items()
            if stream.waiting is not None and _has_room(stream, now_s)
        ]
        if not ready:
            return None
        _turn, robot, (number, captured_s, packet) = min(ready)
        self._turns += 1
        stream = self._streams[robot]
        stream.turn, stream.waiting = self._turns, None
        stream.underway[number] = (now_s, captured_s)
        return packet

    def next_s(self) -> float | None:
        """Time at which an undrawn picture counts as lost and the next may be sent; None: no picture waits."""
        held = [
            min(sent_s for sent_s, _captured in stream.underway.values()) + DRAWN_WITHIN_S
            for stream in self._streams.values()
            if stream.waiting is not None and len(stream.underway) >= PICTURES_UNDERWAY
        ]
        return min(held, default=None)


def _has_room(stream: _PictureStream, now_s: float) -> bool:
    if len(stream.underway) >= PICTURES_UNDERWAY:
        stream.underway = {n: at for n, at in stream.underway.items() if now_s < at[0] + DRAWN_WITHIN_S}
    return len(stream.underway) < PICTURES_UNDERWAY
