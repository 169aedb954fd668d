"""Episodes: a robot's pictures, reports and actions in each of its grants, at a fixed rate. Pure.

An episode is the time in which one ARC held the robot under one epoch, according to the robot's RC; the holder at the
recording's begin is that of the first schedule. It begins with the first step at which each camera has sent a picture
and the robot has reported all its readings. A step has the newest data sent before it, so it contains nothing that the
commander could not know. An episode ends at a message of the robot, or a picture, that this release cannot read.

Source: a step (observation and present action) has the form of LeRobot's steps, see ``lerobot_dataset``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from backbone.component.messages import ComponentState
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import Connect, Connected, Disconnected, RcState
from backbone.recording.presence import Presence
from backbone.recording.reader import Recorded
from backbone.recording.revival import Reviver
from backbone.scheduling.requests import Holder
from backbone.scheduling.views import Schedule
from backbone.wire import Message, schema_of
from resource_pool.arc_client import Applied, Frame, Halt, Readings

ACTION = ("forward_m_s", "turn_rad_s")
OWN_CAMERA = "camera"
"""Name of the camera whose pictures have the address of the ARC; further ones are named by their role."""
STILL = (0.0, 0.0)
_FRAME = schema_of(Frame)
_FOLLOWED = (Connect, Connected, Disconnected, RcState, Schedule, Presence, Readings, Applied)


@dataclass
class Survey:
    """The data of one robot in a recording.

    Attributes:
        kind: Type of the robot; empty: not known.
        robots: Names of all robots.
        arcs: ARCs that held the robot.
        reports: Fields of its readings, in the order of their first appearance.
        sizes_px: Camera → width and height of its first picture.
        owners: ARC → address of its decision process.
        users: Address of a console → name of its user.
        unread: Number of messages of another form or version, which are left out.
    """

    kind: str = ""
    robots: set[str] = field(default_factory=set)
    arcs: set[str] = field(default_factory=set)
    reports: dict[str, None] = field(default_factory=dict)
    sizes_px: dict[str, tuple[int, int]] = field(default_factory=dict)
    owners: dict[str, str] = field(default_factory=dict)
    users: dict[str, str] = field(default_factory=dict)
    unread: int = 0

    def commander(self, arc: str) -> str:
        """Return the name of the person or behavior that owns the ARC; empty: not known."""
        owner = self.owners.get(arc, "")
        return self.users.get(owner, owner.rpartition("/")[2])

    def is_of_a_person(self, arc: str) -> bool:
        """Return whether a console owns the ARC."""
        return self.owners.get(arc, "").startswith(f"{Subsystem.UI_CONSOLE}/")


@dataclass(frozen=True, slots=True)
class EpisodeStep:
    """One step of an episode.

    Attributes:
        episode: Number of the episode, from 0.
        number: Number of the step in the episode, from 0.
        at_s: Mission time.
        state: The newest value of each of ``Survey.reports``; a flag is 0 or 1.
        action: Present velocities by the last applied command, in the order of ``ACTION``.
        pictures: Camera → its newest picture.
        arc: The ARC that holds the robot.
    """

    episode: int
    number: int
    at_s: float
    state: tuple[float, ...]
    action: tuple[float, float]
    pictures: dict[str, Frame]
    arc: str


def keys_of(robot: str) -> tuple[str, ...]:
    """Return the patterns of the keys with data of a robot."""
    return (f"{Subsystem.RESOURCE_POOL}/{robot}/*", "*/frames", "*/schedule", "*/status")


def survey(messages: Iterable[Recorded], robot: str) -> Survey:
    """Return the data of a robot in these messages."""
    found, reviver, its = Survey(), Reviver(), address(Subsystem.RESOURCE_POOL, robot)
    for message in messages:
        if message.schema == _FRAME:
            body = _fields(message)
            if body.get("arc") in found.arcs:
                found.sizes_px.setdefault(_camera(message.key), (body["width_px"], body["height_px"]))
            continue
        match reviver.revived(message, *_FOLLOWED, ComponentState, Frame):
            case Schedule() as schedule:
                found.owners.update((request.arc, request.owner) for request in schedule.requests)
                found.robots.update(rc.rc for rc in schedule.rcs if rc.is_robot)
                found.arcs.update(holder.arc for holder in _holders(schedule, robot))
                found.kind = next((rc.kind for rc in schedule.rcs if rc.rc == robot), found.kind)
            case ComponentState(user=user, address=at) if user:
                found.users[at] = user
            case RcState(holders=holders) if message.source == its:
                found.arcs.update(holder.arc for holder in holders)
            case Connect(arc=arc) if _address_in(message.key) == its:
                found.arcs.add(arc)
            case Readings(values=values) if message.source == its:
                found.reports.update(dict.fromkeys(values))
    found.unread = reviver.unread
    return found


class Follower:
    """Follows a robot through the messages of a recording, and yields the steps of its episodes.

    Attributes:
        grants: Number of grants so far.
        episodes: Number of grants with at least one step.
    """

    def __init__(self, robot: str, reports: Iterable[str], cameras: Iterable[str], rate_hz: int) -> None:
        self.grants = self.episodes = 0
        self._reviver = Reviver()
        self._its = address(Subsystem.RESOURCE_POOL, robot)
        self._reports, self._cameras, self._rate_hz = tuple(reports), frozenset(cameras), rate_hz
        self._robot = robot
        self._asked: Connect | None = None
        self._arc, self._epoch = "", 0
        self._is_holder_known = False
        self._values: dict[str, float] = {}
        self._begin_s: float | None = None
        self._number = 0
        self._action = STILL
        self._pictures: dict[str, Frame] = {}

    def follow(self, messages: Iterable[Recorded]) -> Iterator[EpisodeStep]:
        """Yield the steps before each message, and the remaining steps until the last message."""
        for message in messages:
            yield from self._steps_before(message.at_s)
            self._take(message)
            if self._begin_s is None and self._arc and self._is_complete():
                self._begin_s = message.at_s

    def _is_complete(self) -> bool:
        return self._cameras <= self._pictures.keys() and all(name in self._values for name in self._reports)

    def _steps_before(self, at_s: float) -> Iterator[EpisodeStep]:
        while self._begin_s is not None and (step_s := self._begin_s + self._number / self._rate_hz) < at_s:
            if self._number == 0:
                self.episodes += 1
            state = tuple(self._values[name] for name in self._reports)
            pictures = {name: self._pictures[name] for name in sorted(self._cameras)}
            yield EpisodeStep(self.episodes - 1, self._number, step_s, state, self._action, pictures, self._arc)
            self._number += 1

    def _take(self, message: Recorded) -> None:
        is_its = self._its in (message.source, _address_in(message.key))
        if message.key.endswith(f"/{Conversation.FRAMES}"):
            self._take_picture(message)
            return
        unread, told = self._reviver.unread, self._reviver.revived(message, *_FOLLOWED)
        if is_its and self._reviver.unread > unread:
            self._end()
        match told:
            case Connect() if is_its:
                self._asked = told
            case Schedule() if not self._is_holder_known:
                self._is_holder_known = True  # the RC publishes each later grant
                for holder in _holders(told, self._robot):
                    self._begin(holder.arc, holder.epoch)
            case Presence(alive=False) if is_its:
                self._end()
            case _ if message.source == self._its:
                self._heard_itself(told)

    def _take_picture(self, message: Recorded) -> None:
        if self._arc and _fields(message).get("arc", self._arc) == self._arc:
            picture = self._reviver.revived(message, Frame)
            if picture is None:
                self._end()
            else:
                self._pictures[_camera(message.key)] = picture

    def _heard_itself(self, told: Message | None) -> None:
        """Process a message of the robot's RC, because only the RC knows the present holder."""
        match told:
            case Connected(epoch=epoch) if self._asked is not None and self._asked.epoch == epoch:
                self._begin(self._asked.arc, epoch)
            case Disconnected():
                self._end()
            case RcState():
                holders = {one.epoch: one.arc for one in told.holders}
                if self._epoch not in holders:
                    self._end()
                for epoch, arc in holders.items():
                    self._begin(arc, epoch)
            case Readings():
                self._values.update((name, float(v)) for name, v in told.values.items())
            case Applied():
                self._applied(told)

    def _applied(self, told: Applied) -> None:
        if told.epoch != self._epoch:
            return
        if told.command == Halt.word():
            self._action = STILL
        elif all(name in told.values for name in ACTION):
            self._action = (told.values[ACTION[0]], told.values[ACTION[1]])

    def _begin(self, arc: str, epoch: int) -> None:
        self._is_holder_known = True
        if epoch != self._epoch:
            self._end()
            self._arc, self._epoch = arc, epoch
            self.grants += 1

    def _end(self) -> None:
        self._is_holder_known = True
        self._arc, self._epoch, self._begin_s, self._number = "", 0, None, 0
        self._action, self._pictures = STILL, {}


def _fields(message: Recorded) -> dict[str, Any]:
    """Return the fields of a message; a picture is not decoded, because it may not be needed."""
    return message.body if isinstance(message.body, dict) else {}


def _holders(schedule: Schedule, robot: str) -> list[Holder]:
    return [holder for rc in schedule.rcs if rc.rc == robot for holder in rc.holders]


def _address_in(key: str) -> str:
    return "/".join(key.split("/")[2:-1])


def _camera(key: str) -> str:
    further = key.split("/")[4:-1]  # after scout, mission, resource_pool and the ARC
    return further[0] if further else OWN_CAMERA
