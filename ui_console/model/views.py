"""Content of screens as plain values: messages with people's names, and a struct for each other kind of row.

Times ending in ``_s`` are mission seconds; ages and remaining times are seconds counted from the view's ``now_s``. A
negative time, age or remaining time means that there is none.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec

from backbone.component.messages import ComponentState, LifeState, StoryEvent
from backbone.creator.messages import HostLoad
from backbone.scheduling.views import RequestView
from backbone.wire import plain
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.gauges import GaugeView
from ui_console.model.order_board import OrderView
from ui_console.model.timeline import TimelineView

NONE_S = -1.0
"""Value of a time, an age or a remaining time that does not exist."""

LEAVING = (LifeState.DRAINING, LifeState.STOPPED)
"""States of a component whose end raises no alarm."""


class Severity(StrEnum):
    """Severity of an alarm, highest first."""

    ALARM = "alarm"  # a robot may act wrongly, or not at all
    WARNING = "warning"  # the mission continues with restrictions
    NOTICE = "notice"  # an operator should know


class AlarmKind(StrEnum):
    """Subject of an alarm."""

    STOPPED = "stopped"  # an operator stopped a robot
    LOST = "lost"  # a component ended without a request to stop
    ABSENT = "absent"  # a wanted component is absent
    UNSAFE = "unsafe"  # an RC did not reach its safe state
    RC_DOWN = "rc_down"  # the RC manager cannot reach an RC
    LINK = "link"  # this console has no link to the hub
    BATTERY = "battery"  # the battery of a robot is low
    STALE_VIDEO = "stale_video"  # the picture by which the operator drives is old
    STARVING = "starving"  # a request waits long, and no end is predicted
    DEADLINE = "deadline"  # packets on a radio are late
    OVERLOAD = "overload"  # a host is overloaded
    TAKEN = "taken"  # another ARC got this console's robot
    REFUSED = "refused"  # a component refused a request of this console
    NO_ANSWER = "no_answer"  # a component did not answer this console
    NOT_RECORDED = "not_recorded"  # the trace of the schedule cannot be written any more
    VISITOR = "visitor"  # a client of the web console failed to authenticate, or broke the protocol


class StopView(msgspec.Struct, frozen=True):
    """An operator's stop that is in force.

    Attributes:
        number: Number by which a lift names the stop.
        reason: Reason given by its author.
        age_s: Age of the stop.
        is_confirmed: False if the wheels may still turn for a moment.
        by_user: Its first author, for people.
        also: Further authors since, for people.
        is_mine: True if this operator is its only author.
        lift_line: How it is lifted, for people.
    """

    number: int
    reason: str
    age_s: float
    is_confirmed: bool
    by_user: str
    also: list[str]
    is_mine: bool
    lift_line: str


class VideoView(msgspec.Struct, frozen=True):
    """State of one robot's pictures at this console.

    Attributes:
        robot: The robot.
        age_s: Age of the newest picture.
        rate_hz: Recent picture rate.
        latency_s: Time from capture to arrival of the newest picture.
        is_stale: True: do not drive by these pictures.
    """

    robot: str
    age_s: float
    rate_hz: float
    latency_s: float
    is_stale: bool


class RobotView(msgspec.Struct, frozen=True):
    """A robot.

    Attributes:
        robot: Its name.
        number: Its place in the list, from 1, which is also its key.
        is_up: False if its RC cannot be reached.
        holder: Decision process that holds it; empty: none.
        arc: The holder's ARC.
        is_console: True if the holder is a console.
        is_mine: True if this console has it.
        priority: The holder's priority path, ``mission:10/surveillance:5/watch-scout1:3``.
        epoch: Of the grant.
        since_s: Since when.
        until_s: End of the slice.
        lease_left_s: Time until the hold ends unless it is renewed.
        lease_age_s: Time since the last received renewal.
        because: Why the holder has the robot.
        waiting: Decision processes that wait for the robot, the next first.
        stop: The operator's stop in force; None: it may move.
        video: State of its pictures; None: this console gets none.
        gauges: Its readings, shares first; empty: no readings.
        reported_age_s: Age of the readings.
        feedback: Feedback of its RC.
    """

    robot: str
    number: int
    is_up: bool
    waiting: list[str]
    stop: StopView | None
    feedback: str
    holder: str = ""
    arc: str = ""
    is_console: bool = False
    is_mine: bool = False
    priority: str = ""
    epoch: int = 0
    since_s: float = NONE_S
    until_s: float = NONE_S
    lease_left_s: float = NONE_S
    lease_age_s: float = NONE_S
    because: str = ""
    video: VideoView | None = None
    gauges: list[GaugeView] = []
    reported_age_s: float = NONE_S


class NodeState(StrEnum):
    """State of a node of the behavior tree."""

    RUNNING = "running"  # holds its ARC, or needs no ARC
    WAITING = "waiting"  # waits for its ARC
    IDLE = "idle"  # wants no time now
    SUCCESS = "success"
    FAILURE = "failure"
    STARTING = "starting"
    LOST = "lost"


class NodeView(msgspec.Struct, frozen=True):
    """A node of the behavior tree; the order is parents before children, siblings of higher priority first.

    Attributes:
        name: Of the node and its component.
        type: Component type.
        parent: Name of its parent; empty for a root.
        depth: 0 for a root.
        priority: Priority among its siblings, if known; None: no node at or below it ever requested an ARC.
        state: Its state.
        since_s: Since when.
        feedback: Its activity, in its own words.
        arc: The ARC that it claims; empty: none yet.
        because: Why its ARC waits or runs.
    """

    name: str
    type: str
    parent: str
    depth: int
    priority: int | None
    state: NodeState
    since_s: float
    feedback: str
    arc: str
    because: str


class AlarmView(msgspec.Struct, frozen=True):
    """An alarm.

    Attributes:
        key: Key to acknowledge it.
        kind: Its subject.
        severity: Its severity.
        subject: Name to ask ``why`` about.
        line: The event or condition, for people.
        remedy: Advice; empty: no action is needed, or it is over.
        first_s: Time of its first occurrence.
        last_s: Time of its last occurrence, or of its end.
        count: Number of occurrences.
        is_active: True while the condition lasts; False: it is over, or was an event.
        acknowledged_by: The person who acknowledged it; empty: none.
        while_away: True if it was raised while the operator was away, and is not acknowledged.
        where: Type and machine of the subject, for people; empty: unknown.
        robot: The robot concerned, whose row and picture to show; empty: none.
        also: Consequences of the same cause, one line each.
        keys: Keys for the acknowledgment of this line and its consequences.
    """

    key: str
    kind: AlarmKind
    severity: Severity
    subject: str
    line: str
    remedy: str
    first_s: float
    last_s: float
    count: int
    is_active: bool
    acknowledged_by: str
    while_away: bool
    where: str = ""
    robot: str = ""
    also: list[str] = []
    keys: list[str] = []


class HostView(msgspec.Struct, frozen=True):
    """A machine of the mission: its creator's report, and the report's age."""

    load: HostLoad
    age_s: float


class LinkView(msgspec.Struct, frozen=True):
    """A link.

    Attributes:
        name: ``hub``; ``commands`` to this console's robot; a radio's name.
        is_up: False if no message passes.
        latency_s: Round-trip time.
        feedback: Further text for people.
    """

    name: str
    is_up: bool
    latency_s: float
    feedback: str


class ParameterView(msgspec.Struct, frozen=True):
    """A parameter of a component, by its newest report.

    Attributes:
        component: Name of the component.
        address: Its address.
        name: Name of the parameter.
        value: As JSON.
        before: As JSON, before the last change that this console received; empty: no change received.
        changed_by: Author of the change.
        changed_s: Time of the change.
    """

    component: str
    address: str
    name: str
    value: str
    before: str = ""
    changed_by: str = ""
    changed_s: float = NONE_S


class ConsentView(msgspec.Struct, frozen=True):
    """A question of an operator: to get the robot that this console holds, or to lift a stop of its operator.

    Attributes:
        user: The operator who asks.
        robot: The robot.
        why: The reason, for people.
        left_s: Seconds until the question times out; the answer is then no.
        others: Number of further questions.
        topic: ``take``: to get the robot; ``lift``: to let it move again.
        line: The question in one sentence, for people.
        number: Number of the question, which the answer names.
    """

    user: str
    robot: str
    why: str
    left_s: float
    others: int
    topic: str
    line: str
    number: int


class LostView(msgspec.Struct, frozen=True):
    """A robot that this operator lost without releasing it.

    Attributes:
        robot: The robot.
        why: The reason, for people.
        at_s: Time of the loss.
        may_retake: True if the screen offers to take it back: the robot is present, and this console has no request.
    """

    robot: str
    why: str
    at_s: float
    may_retake: bool


class OwnView(msgspec.Struct, frozen=True):
    """The robot that this console wants or holds, and its operator's state.

    Attributes:
        console: Its name.
        user: The person at it.
        robot: Robot wanted or held; empty: any, or none.
        is_held: True: keys move the robot; always False while the link is down.
        is_asked: True: it is wanted.
        status: One line: whether the robot is held, and if not, why.
        epoch: Of the grant; 0: none.
        until_s: End of the slice.
        taken_because: If another ARC has the robot: the reason, and that ARC's owner.
        applied: The last command applied, for people.
        stop: The stop in force on the robot held; None: it may move.
        away_since_s: Since when the operator is away.
        consent: The next question for this operator; None: no question.
        asked: One line with other operators' answers to this console's questions; empty: no question was asked.
        other_screens: Other screens of the same person, one line each.
        must_let_go: True: a held control moves nothing before it is released and pressed again.
        lost: The robot lost without a release, until the operator takes a robot or dismisses the notice.
        link_down_s: Time from which the mission's hub is silent; negative: the link is up.
        moment: Grows with each stop, lift, grant and loss; a press that began at an earlier moment moves nothing.
        orders: The operator's orders, by robot.
        is_unsure: True: the robot was held before the link was cut; its ARC has not confirmed that it still is.
    """

    console: str
    user: str
    robot: str
    is_held: bool
    is_asked: bool
    status: str
    epoch: int
    until_s: float
    taken_because: str
    applied: str
    stop: StopView | None
    away_since_s: float
    consent: ConsentView | None = None
    asked: str = ""
    other_screens: list[str] = []
    must_let_go: bool = False
    lost: LostView | None = None
    link_down_s: float = NONE_S
    moment: int = 0
    orders: list[OrderView] = []
    is_unsure: bool = False


class HealthView(msgspec.Struct, frozen=True):
    """The mission's health.

    Attributes:
        word: ``ok``, ``starting``, ``degraded`` or ``failed``.
        lines: One line for each wanted and absent component: begin, reason and remedy.
    """

    word: str
    lines: list[str]


class ConsoleView(msgspec.Struct, frozen=True):
    """Content of a console at one moment."""

    mission: str
    now_s: float
    own: OwnView
    robots: list[RobotView]
    tree: list[NodeView]
    requests: list[RequestView]
    timeline: TimelineView
    alarms: list[AlarmView]
    hosts: list[HostView]
    links: list[LinkView]
    videos: list[VideoView]
    parameters: list[ParameterView]
    components: list[ComponentState]
    log: list[StoryEvent]
    health: HealthView | None = None
    abilities: ArcAbilities | None = None


def view_json(view: object) -> bytes:
    """Return a view as JSON; messages in it are also encoded with field names."""
    return msgspec.json.encode(plain(view))
