"""What every component can be asked, and what it says of itself unasked."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

from backbone.ranges import MANY, Address, Count, Instant, Measure, Mention, Pid, Rate, Text, Values
from backbone.wire import Message


class LifeState(StrEnum):
    """Where a component is in its life; it only moves downwards in this list."""

    CONNECTING = "connecting"  # exists, cannot be asked yet
    READY = "ready"  # its liveliness token stands
    DRAINING = "draining"  # ends what it began, takes nothing new
    STOPPED = "stopped"  # left the bus in good order
    FAILED = "failed"  # ended by a bug; the process is about to die


class AskState(Message, frozen=True):
    """Who are you and how are you?"""


class Absence(Message, frozen=True):
    """A component that its owner wants and that does not run, or does not respond.

    Attributes:
        name: Name of the absent component.
        since_s: Mission time at which its owner first missed it.
        cause: Why it is absent: how it ended, or what refused its start. One line.
        doing: What its owner does about it, one line; empty: nothing more.
        remedy: What an operator can do; empty: nothing is needed.
        vital: True if the mission cannot do its work without it (core services).
    """

    name: Mention
    since_s: Instant
    cause: Text
    doing: Text = ""
    remedy: Text = ""
    vital: bool = False


class StandingStop(Message, frozen=True):
    """An emergency stop that is in force: the component moves nothing until an operator lifts it.

    Attributes:
        number: Grows with each stop; the one that is lifted is named by it.
        by: The operator who stopped the component.
        reason: As given; may be empty.
        since_s: Mission time of the stop.
        is_confirmed: False if the hardware did not confirm that it stands still.
    """

    number: Count
    by: Text
    reason: Text
    since_s: Instant
    is_confirmed: bool = True


class ComponentState(Message, frozen=True):
    """Answer to ``AskState``; also published as the component's status on every change.

    Attributes:
        address: ``<subsystem>/<name>``.
        type: Component type as named in the mission file.
        host: Host it runs on.
        pid: Its process.
        state: Where it is in its life.
        since_s: Mission time at which it entered that state.
        feedback: One line for people: what it is doing.
        requester: Address of whoever had it started.
        absent: Components that this one wants and that are absent.
        stop: The emergency stop in force on it; None: there is none.
        user: The person who sits at it, as they call themselves; empty: nobody does.
    """

    address: Address
    type: Mention
    host: Mention
    pid: Pid
    state: LifeState
    since_s: Instant
    feedback: Text = ""
    requester: Mention = ""
    absent: Annotated[list[Absence], MANY] = []
    stop: StandingStop | None = None
    user: Mention = ""


class AskTime(Message, frozen=True):
    """What time is it in your mission?"""


class MissionTime(Message, frozen=True):
    """Answer to ``AskTime``.

    Attributes:
        at_s: Mission time at which this was answered.
        rate: Mission seconds per second of the machine.
    """

    at_s: Instant
    rate: Rate


class AskStatistics(Message, frozen=True):
    """What did you count?"""


class Statistics(Message, frozen=True):
    """Answer to ``AskStatistics``: named counters and measures with their unit in the name."""

    values: Annotated[dict[Mention, Measure], MANY]


class AskParameters(Message, frozen=True):
    """With which parameters do you run?"""


class Parameters(Message, frozen=True):
    """Answer to ``AskParameters`` and ``SetParameter``: all parameters as they are now."""

    values: Values


class SetParameter(Message, frozen=True):
    """Run with this value from now on. Refused, and nothing changed, if the value does not fit.

    Attributes:
        name: Name of the parameter.
        value: The new value.
        user: Who wants it, for the record.
    """

    name: Mention
    value: Any
    user: Mention = ""


class AskStory(Message, frozen=True):
    """What happened to you lately?

    Attributes:
        subject: Only events about this name; empty for all.
    """

    subject: Mention = ""


class LogLevel(StrEnum):
    """How much something that happened matters, most first."""

    ALARM = "alarm"  # a robot may do what it should not, or nothing any more
    WARNING = "warning"  # the mission goes on, less well
    NOTICE = "notice"  # what people and behaviors did or found
    INFO = "info"


class StoryEvent(Message, frozen=True):
    """One thing that happened.

    Attributes:
        at_s: Mission time.
        where: Address of the component that tells it.
        what: Past tense, one line.
        subject: The name it is about.
        cause: Id of the message that led to it, empty for a first cause.
        level: How much it matters.
        user: The person who did it; empty: nobody in person.
    """

    at_s: Instant
    where: Mention
    what: Text
    subject: Mention
    cause: Mention
    level: LogLevel = LogLevel.INFO
    user: Mention = ""


class Story(Message, frozen=True):
    """Answer to ``AskStory``: the newest events, oldest first."""

    events: Annotated[list[StoryEvent], MANY]


class Stop(Message, frozen=True):
    """End in good order: finish what you began, go to the safe state, leave.

    Attributes:
        reason: For the record.
        incarnation: The one life that is meant, see ``Launch.incarnation``; empty: the component of this address.
            Another life of the same address refuses with ``OtherIncarnation``.
    """

    reason: Text = ""
    incarnation: Mention = ""


class Stopping(Message, frozen=True):
    """Answer to ``Stop``: it is on its way out."""


CommonQuestion = AskState | AskTime | AskStatistics | AskParameters | SetParameter | AskStory | Stop
