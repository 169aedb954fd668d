"""What the screens show, worked out of what was heard.

Rules of this file: no bus, no clock, no screen. Events go in, lines and rows come out; times are
mission seconds, and *now* is an argument.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec

from backbone.component.messages import StoryEvent
from backbone.rc_manager.messages import RcView, RequestState, RequestView, Schedule, Why

ROBOT_KIND = "scout"
ALARMS_KEPT = 100  # chosen: a day's worth for a person; older ones are in the recording


# ---------------------------------------------------------------------- what a console hears
@dataclass(frozen=True, slots=True)
class Asked:
    """A robot was asked for."""

    at_s: float
    robot: str
    kind: str
    priority: int


@dataclass(frozen=True, slots=True)
class Granted:
    """The RCs are held; told again, with ``again``, after each suspension.

    Attributes:
        at_s: Mission time.
        rcs: Kind → name of what is held.
        epochs: RC → epoch.
        until_s: The slice lasts at least until then.
        asked_s: When it was asked for.
        again: True if it was held before.
    """

    at_s: float
    rcs: Mapping[str, str]
    epochs: Mapping[str, int]
    until_s: float
    asked_s: float
    again: bool

    @property
    def after_s(self) -> float:
        """How long the grant took, from the wish on, mission seconds."""
        return self.at_s - self.asked_s


@dataclass(frozen=True, slots=True)
class Lost:
    """The RCs went to somebody else.

    Attributes:
        at_s: Mission time.
        reason: Why.
        by: Because of whom.
        expected_start_s: Next expected slot; negative: unknown.
    """

    at_s: float
    reason: str
    by: str
    expected_start_s: float


@dataclass(frozen=True, slots=True)
class CommandApplied:
    """A robot did what it was told, perhaps clipped."""

    at_s: float
    rc: str
    epoch: int
    command: str
    values: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class CommandRefused:
    """Somebody said no."""

    at_s: float
    code: str
    detail: str
    remedy: str


@dataclass(frozen=True, slots=True)
class LinkTrouble:
    """Somebody did not answer: what was asked may or may not have happened."""

    at_s: float
    detail: str


@dataclass(frozen=True, slots=True)
class GivenBack:
    """The robot was given back; ``confirmed`` is False if nobody confirmed it."""

    at_s: float
    reason: str
    confirmed: bool


@dataclass(frozen=True, slots=True)
class PictureSeen:
    """A picture arrived."""

    at_s: float
    captured_s: float
    robot: str


@dataclass(frozen=True, slots=True)
class ScheduleHeard:
    """The RC manager's schedule changed."""

    at_s: float
    schedule: Schedule


@dataclass(frozen=True, slots=True)
class WhyHeard:
    """The RC manager said why this console waits."""

    at_s: float
    why: Why


@dataclass(frozen=True, slots=True)
class StoryHeard:
    """A component told what just happened to it."""

    at_s: float
    story: StoryEvent


ConsoleEvent = (
    Asked
    | Granted
    | Lost
    | CommandApplied
    | CommandRefused
    | LinkTrouble
    | GivenBack
    | PictureSeen
    | ScheduleHeard
    | WhyHeard
    | StoryHeard
)

_WORDS: dict[type[Any], str] = {
    Asked: "asked",
    Lost: "suspended",
    CommandApplied: "applied",
    CommandRefused: "refused",
    LinkTrouble: "no_answer",
    GivenBack: "released",
    PictureSeen: "picture",
    ScheduleHeard: "schedule",
    WhyHeard: "why",
    StoryHeard: "story",
}


def event_word(event: ConsoleEvent) -> str:
    """Return the word of an event in JSON output: ``granted``, ``suspended``, ``resumed`` and so on."""
    if isinstance(event, Granted):
        return "resumed" if event.again else "granted"
    return _WORDS[type(event)]


def event_json(event: ConsoleEvent) -> bytes:
    """Return the event as one line of JSON, without its end.

    Example:
        >>> event_json(Lost(2.0, "higher", "console-1", -1.0))
        b'{"event":"suspended","at_s":2.0,"reason":"higher","by":"console-1","expected_start_s":-1.0}'
    """
    plain: dict[str, Any] = msgspec.to_builtins(_by_name(event))
    if isinstance(event, Granted):
        plain["after_s"] = event.after_s
    return msgspec.json.encode({"event": event_word(event), **plain})


def _by_name(value: Any) -> Any:
    """Return messages, which travel as arrays, as dictionaries of their fields, all the way down."""
    if isinstance(value, msgspec.Struct):
        return {name: _by_name(getattr(value, name)) for name in value.__struct_fields__}
    if hasattr(value, "__dataclass_fields__"):
        return {name: _by_name(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, list | tuple):
        return [_by_name(item) for item in value]
    if isinstance(value, Mapping):
        return {str(name): _by_name(item) for name, item in value.items()}
    return value


# ---------------------------------------------------------------------- what a console shows
@dataclass(frozen=True, slots=True)
class RobotRow:
    """One robot in the table.

    Attributes:
        robot: Its name.
        holder: Decision process that has it; empty: nobody.
        priority: The holder's priority path.
        since_s: Since when.
        until_s: End of the slice; negative: unknown.
        because: Why it has it.
        waiting: Decision processes that want it, the next first.
    """

    robot: str
    holder: str
    priority: str
    since_s: float
    until_s: float
    because: str
    waiting: tuple[str, ...]


@dataclass
class ConsoleModel:
    """All a console knows; screens read it, events change it.

    Attributes:
        name: Name of this console.
        robot: Robot asked for or held; empty: any, or none.
        held: The grant, while the RCs are held.
        lost: Why they are not.
        asked: The standing wish; None after a release.
        why: What the RC manager last said of the wait.
        picture: The newest picture's times.
        applied: The last command that was applied.
        schedule: As last heard.
        alarms: What went wrong or was found out, oldest first: (mission time, line).
    """

    name: str
    robot: str = ""
    held: Granted | None = None
    lost: Lost | None = None
    asked: Asked | None = None
    why: Why | None = None
    picture: PictureSeen | None = None
    applied: CommandApplied | None = None
    schedule: Schedule | None = None
    alarms: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=ALARMS_KEPT))

    def apply(self, event: ConsoleEvent) -> None:
        """Take the event in."""
        match event:
            case Asked(robot=robot):
                self.asked, self.robot, self.held, self.lost, self.why = event, robot, None, None, None
            case Granted(rcs=rcs):
                self.held, self.lost, self.why = event, None, None
                self.robot = rcs.get(ROBOT_KIND, self.robot)
            case Lost(reason=reason, by=by):
                self.held, self.lost = None, event
                self._alarm(event.at_s, f"robot taken: {reason} by {by}")
            case CommandApplied():
                self.applied = event
            case CommandRefused(detail=detail, remedy=remedy):
                self._alarm(event.at_s, f"refused: {detail} ({remedy})")
            case LinkTrouble(detail=detail):
                self._alarm(event.at_s, f"no answer: {detail}")
            case GivenBack(confirmed=confirmed):
                self.held = self.asked = self.lost = self.why = self.applied = None
                self._alarm(event.at_s, "given back" if confirmed else "given back, but nobody confirmed it")
            case PictureSeen():
                self.picture = event
            case ScheduleHeard(schedule=schedule):
                self.schedule = schedule
            case WhyHeard(why=why):
                self.why = why
            case StoryHeard(story=story):
                self._alarm(story.at_s, f"{story.subject}: {story.what}")

    def robots(self) -> list[RobotRow]:
        """Return one row for each robot in the schedule, sorted by name."""
        if self.schedule is None:
            return []
        requests = {request.arc: request for request in self.schedule.requests}
        return [_row(rc, requests) for rc in sorted(self.schedule.rcs, key=lambda rc: rc.rc) if rc.kind == ROBOT_KIND]

    def schedule_lines(self, now_s: float) -> list[str]:
        """Return one line for each request: who runs until when, who waits why."""
        requests = self.schedule.requests if self.schedule is not None else []
        ordered = sorted(requests, key=lambda request: (request.state is not RequestState.RUNNING, request.arc))
        return [_request_line(request, now_s) for request in ordered]

    def status_line(self, now_s: float) -> str:
        """Return in one line whether this console has its robot, and if not, why."""
        if self.held is not None:
            left_s = self.held.until_s - now_s
            slice_end = f", slice {left_s:.0f} s" if left_s > 0 else ""
            return f"you hold {self.robot or 'no robot'} (epoch {max(self.held.epochs.values(), default=0)}){slice_end}"
        if self.asked is None:
            return "watching; you hold no robot"
        wanted = self.robot or "a robot"
        if self.why is not None and self.why.lines:
            return f"waiting for {wanted}: {self.why.lines[0]}"
        if self.lost is not None:
            return f"waiting for {wanted}: {self.lost.reason} by {self.lost.by}"
        return f"waiting for {wanted}"

    def video_line(self, now_s: float) -> str:
        """Return the age of the newest picture, or that there is none."""
        if self.picture is None:
            return "no picture yet"
        return f"{self.picture.robot}: picture {max(0.0, now_s - self.picture.captured_s):.1f} s old"

    def alarm_lines(self, count: int) -> list[str]:
        """Return the newest alarms, newest first."""
        return [f"{at_s:8.1f} s  {line}" for at_s, line in reversed(list(self.alarms)[-count:])] if count else []

    def _alarm(self, at_s: float, line: str) -> None:
        if not self.alarms or self.alarms[-1][1] != line:  # a refusal that repeats ten times a second is told once
            self.alarms.append((at_s, line))


def _row(rc: RcView, requests: Mapping[str, RequestView]) -> RobotRow:
    waiting = tuple(_owner(requests[arc]) for arc in rc.next if arc in requests)
    if not rc.holders:
        return RobotRow(rc.rc, "", "", -1.0, -1.0, "", waiting)
    holder = rc.holders[0]
    request = requests.get(holder.arc)
    if request is None:
        return RobotRow(rc.rc, holder.arc, "", holder.since_s, -1.0, "", waiting)
    return RobotRow(rc.rc, _owner(request), request.priority, holder.since_s, request.until_s, request.because, waiting)


def _owner(request: RequestView) -> str:
    return request.owner.rpartition("/")[2]


def _request_line(request: RequestView, now_s: float) -> str:
    if request.state is RequestState.RUNNING:
        when = f"{max(0.0, request.until_s - now_s):4.1f} s left" if request.until_s >= 0 else "running"
    elif request.expected_start_s >= 0:
        when = f"in {max(0.0, request.expected_start_s - now_s):4.1f} s"
    else:
        when = str(request.state)
    because = request.because.removeprefix(f"{request.arc} {request.state}: ")
    return f"{_owner(request)}: {when}; {because}"
