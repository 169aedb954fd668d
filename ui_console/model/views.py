"""Content of screens as plain values: messages by the names of people, and a struct for each other kind of row.

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
from ui_console.model.order_view import OrderView
from ui_console.model.timeline import TimelineView

NONE_S = -1.0
"""In place of a time, an age or a remaining time: there is none."""

LEAVING = (LifeState.DRAINING, LifeState.STOPPED)
"""States of a component whose end raises no alarm."""


class Severity(StrEnum):
    """How much an alarm matters, most first."""

    ALARM = "alarm"  # a robot may do something it should not, or nothing any more
    WARNING = "warning"  # the mission goes on, less well
    NOTICE = "notice"  # an operator should know


class AlarmKind(StrEnum):
    """Subject of an alarm."""

    STOPPED = "stopped"  # an operator stopped a robot
    LOST = "lost"  # a component ended without a request to stop
    ABSENT = "absent"  # a component is wanted and absent
    UNSAFE = "unsafe"  # an RC did not reach its safe state
    RC_DOWN = "rc_down"  # the RC manager cannot reach an RC
    LINK = "link"  # this console has no link to the hub
    BATTERY = "battery"  # the battery of a robot is low
    STALE_VIDEO = "stale_video"  # the picture the operator drives by is old
    STARVING = "starving"  # a request waits long and no end is in sight
    DEADLINE = "deadline"  # packets on a radio come too late
    OVERLOAD = "overload"  # a host has no time to spare
    TAKEN = "taken"  # another ARC got this console's robot
    REFUSED = "refused"  # a component refused a request of this console
    NO_ANSWER = "no_answer"  # a component did not answer this console
    NOT_RECORDED = "not_recorded"  # the trace of the schedule cannot be written any more
    VISITOR = "visitor"  # a client of the web console failed to authenticate, or broke the protocol


class StopView(msgspec.Struct, frozen=True):
    """An operator's stop that is in force.

    Attributes:
        number: A lift names the stop by it.
        reason: As its author gave it.
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
    """Pictures of one robot as they arrive at this console.

    Attributes:
        robot: The robot.
        age_s: Since the newest was taken.
        rate_hz: Pictures a second, lately.
        latency_s: From capture to here, of the newest.
        is_stale: True: do not drive by it.
    """

    robot: str
    age_s: float
    rate_hz: float
    latency_s: float
    is_stale: bool


class RobotView(msgspec.Struct, frozen=True):
    """One robot.

    Attributes:
        robot: Its name.
        number: Its place in the list, from 1; the key that picks it.
        is_up: False if its RC cannot be reached.
        holder: Decision process that holds it; empty: none.
        arc: The holder's ARC.
        is_console: True if the holder is a console.
        is_mine: True if this console has it.
        priority: The holder's priority path, ``mission:10/surveillance:5/watch-scout1:3``.
        epoch: Of the grant.
        since_s: Since when.
        until_s: End of the slice.
        lease_left_s: Until the hold ends unless it is renewed.
        lease_age_s: Since the last renewal was heard.
        because: Why the holder has it.
        waiting: Decision processes that wait for it, the next first.
        stop: The operator's stop in force; None: it may move.
        video: Its pictures; None: this console gets none.
        gauges: What it reports, shares first; empty: nothing.
        reported_age_s: Age of that.
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

    RUNNING = "running"  # holds its ARC, or needs none
    WAITING = "waiting"  # wants its ARC
    IDLE = "idle"  # wants no time now
    SUCCESS = "success"
    FAILURE = "failure"
    STARTING = "starting"
    LOST = "lost"


class NodeView(msgspec.Struct, frozen=True):
    """A node of the behavior tree; they come parents before children, siblings of higher priority first.

    Attributes:
        name: Of the node and its component.
        type: Component type.
        parent: Name of its parent; empty for a root.
        depth: 0 for a root.
        priority: Among its siblings, as far as it is known; None: nothing at or below it ever asked for an ARC.
        state: Its state.
        since_s: Since when.
        feedback: Its activity, in its own words.
        arc: The ARC it claims; empty: none yet.
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
    """One alarm.

    Attributes:
        key: Key to acknowledge it.
        kind: Its subject.
        severity: How much it matters.
        subject: Name to ask ``why`` about.
        line: The event or condition, for people.
        remedy: An action against it; empty: none is needed, or it is over.
        first_s: When it happened first.
        last_s: When it happened last, or since when it has been over.
        count: How often.
        is_active: True while it is so; False: it is over, or was an event.
        acknowledged_by: The person who acknowledged it; empty: none.
        while_away: True if it came while the operator was away and is not acknowledged.
        where: Type and machine of the subject, for people; empty: unknown.
        robot: The robot it is about, whose row and picture to show; empty: none.
        also: Consequences of the same cause, one line each.
        keys: Keys to acknowledge this line and its consequences.
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
    """One machine of the mission: its creator's report, and the report's age."""

    load: HostLoad
    age_s: float


class LinkView(msgspec.Struct, frozen=True):
    """A link.

    Attributes:
        name: ``hub``; ``commands`` to this console's robot; a radio's name.
        is_up: False if no message passes.
        latency_s: There and back.
        feedback: More about it for people.
    """

    name: str
    is_up: bool
    latency_s: float
    feedback: str


class ParameterView(msgspec.Struct, frozen=True):
    """One parameter of a component, by its newest report.

    Attributes:
        component: Name of the component.
        address: Its address.
        name: Name of the parameter.
        value: As JSON.
        before: As JSON, before the change that this console saw; empty: it saw none.
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
    """An operator asks for the robot this console holds, or to lift a stop of this console's operator.

    Attributes:
        user: The operator who asks.
        robot: The robot.
        why: The reason, for people.
        left_s: Seconds until the question times out, which is a no.
        others: Number of further questions.
        topic: ``take``: to have the robot; ``lift``: to let it move again.
        line: The question in one sentence, for people.
    """

    user: str
    robot: str
    why: str
    left_s: float
    others: int
    topic: str
    line: str


class LostView(msgspec.Struct, frozen=True):
    """A robot that this operator held and lost without releasing it.

    Attributes:
        robot: The robot.
        why: The reason, for people.
        at_s: Time of the loss.
        may_retake: True if the screen offers to take it back: it is there, and this console has no request.
    """

    robot: str
    why: str
    at_s: float
    may_retake: bool


class OwnView(msgspec.Struct, frozen=True):
    """The robot this console wants or holds, and its operator's state.

    Attributes:
        console: Its name.
        user: The person at it.
        robot: Robot wanted or held; empty: any, or none.
        is_held: True: keys move it; never while the link is down.
        is_asked: True: it is wanted.
        status: In one line: whether it is held, and if not, why.
        epoch: Of the grant; 0: none.
        until_s: End of the slice.
        taken_because: While another ARC has the robot: the reason, and that ARC's owner.
        applied: The last command applied, for people.
        stop: The stop in force on the robot held; None: it may move.
        away_since_s: Since when the operator is away.
        consent: The question this operator is to answer; None: none.
        asked: In one line the answers of other operators to this console's questions; empty: none was asked.
        other_screens: Where else the same person sits, one line each: one person with several screens.
        must_let_go: True: a control is held that moves nothing before it is let go and pressed anew.
        lost: The robot lost without a release, until the operator takes one or dismisses it.
        link_down_s: Since when the mission's hub is silent; negative: the link is up.
        moment: Grows with each stop, lift, grant and loss; a press that began at an earlier one moves nothing.
        orders: The operator's orders, by robot.
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


class HealthView(msgspec.Struct, frozen=True):
    """The mission's health.

    Attributes:
        word: ``ok``, ``degraded`` or ``failed``.
        lines: One line for each wanted and absent component: since when, why, and its remedy.
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
    """Return any view as JSON, messages in it too with their fields by name."""
    return msgspec.json.encode(plain(view))
