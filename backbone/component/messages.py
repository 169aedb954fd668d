"""Common messages: the questions that every component answers, its status, and its registration."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

from backbone.component.log_level import LogLevel as LogLevel  # noqa: PLC0414  a part of these messages
from backbone.errors import Refusal
from backbone.incarnation import Incarnation
from backbone.ranges import (
    FEW,
    MANY,
    Address,
    Count,
    Instant,
    MachineTime,
    Measure,
    Mention,
    Pid,
    Rate,
    Start,
    Text,
    Values,
)
from backbone.wire import Message

MESSAGES_DROPPED, DEADLINES_MISSED = "dropped ", "deadlines missed "
"""Prefixes of names of statistics; a key without ``scout/<mission>/`` follows."""


class LifeState(StrEnum):
    """State of a component's life cycle; it only moves downwards in this list."""

    CONNECTING = "connecting"  # exists, does not answer yet
    READY = "ready"  # its liveliness token exists
    DRAINING = "draining"  # finishes its work, begins none
    STOPPED = "stopped"  # left the bus in good order
    FAILED = "failed"  # ended by a bug; its process is ending


class AskState(Message, frozen=True):
    """Ask for the component's state."""


class Absence(Message, frozen=True):
    """A component that its owner wants and that does not run, does not respond, or cannot do its work.

    Attributes:
        since_s: Mission time at which its owner found it missing.
        cause: Why it is absent: how it ended, or the refusal of its start. One line.
        doing: What its owner does to start it, one line; empty: nothing.
        remedy: What an operator can do; empty: no action is needed.
        vital: True if the mission cannot work without it (core services).
        is_running: True if it runs and cannot do its work.
        is_repeated: True if it runs, and has failed again and again since that time; at this moment it may work.
        is_start: True for the mission itself while its first start is not over.
    """

    name: Mention
    since_s: Instant
    cause: Text
    doing: Text = ""
    remedy: Text = ""
    vital: bool = False
    is_running: bool = False
    is_repeated: bool = False
    is_start: bool = False


class Stopper(Message, frozen=True):
    """An operator who stopped a robot.

    Attributes:
        by: Name of the operator, for people; without a name the address of the console.
        console: Address of the operator's console, which is asked before the stop is lifted. Empty: unknown.
    """

    by: Mention
    console: Mention = ""


class StandingStop(Message, frozen=True):
    """An emergency stop in force: the component moves nothing until an operator lifts the stop.

    Attributes:
        number: Grows with each stop; an order to lift names it.
        by: The operators who stopped the component.
        reason: The first operator's reason; may be empty.
        since_s: Mission time of the stop.
        is_confirmed: False if the hardware did not confirm standstill.
        authors: The operators in ``by``, the first of them first; empty: unknown.
    """

    number: Count
    by: Text
    reason: Text
    since_s: Instant
    is_confirmed: bool = True
    authors: Annotated[list[Stopper], FEW] = []


MORE_THAN_ANY_STOP = 1_000_000  # chosen: more orders to stop than any mission has, so no host knows a later one


class LastStop(Message, frozen=True):
    """The last emergency stop of a component, for its next process.

    Attributes:
        number: Number of the last order to stop; 0: it was never stopped.
        standing: The stop, if it is in force; None: it was lifted.
    """

    number: Count = 0
    standing: StandingStop | None = None


class ComponentState(Message, frozen=True, tag="ComponentState/2"):
    """Answer to ``AskState``; also published as the component's status on every change.

    Attributes:
        address: ``<subsystem>/<name>``.
        type: Component type as named in the mission file.
        state: State of its life cycle.
        since_s: Mission time at which it entered that state.
        requester: Address of its owner.
        absent: Absent components that this one wants.
        stop: The emergency stop in force on it; None: no stop.
        user: Name of the person at it, as the person gave it; empty: no person.
        is_robot: True for the RC of a robot, which operators can stop.
        start: Random number of this life, see ``incarnation``.
        stops: Number of the last order to stop it, also if the stop was lifted; 0: it was never stopped.
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
    is_robot: bool = False
    start: Start = 0
    stops: Count = 0

    @property
    def incarnation(self) -> Incarnation:
        """This life of the component."""
        return Incarnation(self.host, self.pid, self.start)


class Register(Message, frozen=True):
    """Register a name at the nameserver. The component shell asks this before its readiness.

    Attributes:
        component: The component; its state is CONNECTING.
    """

    component: ComponentState


class Registered(Message, frozen=True):
    """Answer to ``Register``: the component holds the name until its liveliness token ends.

    Attributes:
        last_stop: The last stop of this component, or of the former one of this name, if it is known.
    """

    last_stop: LastStop = LastStop()


class NameTaken(Refusal):
    """A living component has this name."""

    code = "nameserver.taken"
    remedy = "It runs already: see 'scout-backbone status'. Stop it first, or give the new one a name of its own."


class AskTime(Message, frozen=True):
    """Ask for the mission's time."""


class MissionTime(Message, frozen=True):
    """Answer to ``AskTime``.

    Attributes:
        at_s: Mission time of the answer.
        unix_s: Time of day then on the answerer's machine, seconds since 1970; 0: not known.
        clock_origin_monotonic_s: Its machine's monotonic clock at mission time 0, different for each start of a
            mission; 0: not known.
    """

    at_s: Instant
    rate: Rate
    unix_s: Instant = 0.0
    clock_origin_monotonic_s: MachineTime = 0.0


PROCESSOR_S = "processor_s"
"""Name of a statistic: processor time of the component's process with all its threads; missing on virtual time."""


class AskStatistics(Message, frozen=True):
    """Ask for the component's counters and measures."""


class Statistics(Message, frozen=True):
    """Answer to ``AskStatistics``: counters and measures, with units in their names."""

    values: Annotated[dict[Mention, Measure], MANY]


class AskParameters(Message, frozen=True):
    """Ask for the component's parameters."""


class Parameters(Message, frozen=True):
    """Answer to ``AskParameters`` and ``SetParameter``: all present parameters."""

    values: Values


class SetParameter(Message, frozen=True):
    """Set a parameter. If the value does not fit, the component refuses and changes nothing.

    Attributes:
        value: The new value.
    """

    name: Mention
    value: Any
    user: Mention = ""


class AskStory(Message, frozen=True):
    """Ask for the component's recent events.

    Attributes:
        subject: Only events about this name; empty: all.
    """

    subject: Mention = ""


class StoryEvent(Message, frozen=True):
    """One event of a component.

    Attributes:
        where: Address of the component that recorded it.
        what: The event, past tense, one line.
        subject: Name of its subject.
        cause: Id of the message that led to it; empty: a first cause.
        level: Its importance.
        user: The person who did it; empty: no person.
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
    """End in good order: finish the work in progress, go to the safe state, leave.

    Attributes:
        incarnation: The incarnation to stop, see ``Launch.incarnation``; empty: any. Another incarnation of the
            address refuses with ``OtherIncarnation``.
    """

    reason: Text = ""
    incarnation: Mention = ""


class Stopping(Message, frozen=True):
    """Answer to ``Stop``: the component is ending."""


class OtherIncarnation(Refusal):
    """The order is for another incarnation of this address: another host or another process."""

    code = "component.incarnation"
    remedy = "Nothing to do: the order is for another incarnation."


class WrongParameter(Refusal):
    """A parameter of that name does not exist, or the value does not fit it."""

    code = "component.parameter"
    remedy = "Use a parameter of its class with a value of its type; 'scout-backbone set NAME' lists those of NAME."


class ParameterBug(Refusal):
    """The component failed when it applied the value, and ends; a new process has the value of its start."""

    code = "component.parameter_bug"
    remedy = "Mend parameters_changed of its class; 'scout-backbone story NAME' shows whether NAME was started again."


CommonQuestion = AskState | AskTime | AskStatistics | AskParameters | SetParameter | AskStory | Stop
