"""What can be said to a creator, and what it reports."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from backbone.errors import Refusal
from backbone.naming import Subsystem
from backbone.ranges import (
    FEW,
    MANY,
    Count,
    Duration,
    ExitCode,
    Line,
    Mention,
    Name,
    NameOrNone,
    Pause,
    Pid,
    Share,
    Text,
    Values,
)
from backbone.wire import Message

TYPE = "creator"
READY_WITHIN_S = 10.0  # chosen: silence, not time: a starting process that imports, renders or waits for others beats
CUT_OFF_ENDS_WITHIN_S = (
    7.0  # chosen: a link counts as cut after 2 s, a cut-off host ends all after 3 s, which takes 2 s
)
START_MOST_S = 180.0  # chosen: a start that shows signs of life for so long and is not ready never will be


class RestartPolicy(Message, frozen=True):
    """When a process that ended without an order, or hangs, is replaced.

    Attributes:
        restart: False: never; its owner asks for a new one.
        back_off_s: Pause before the first restart, seconds of the machine; doubles with each one in the window.
        back_off_most_s: Longest pause while there are fewer restarts than ``limit`` in the window.
        limit: Restarts within the window from which on the component is failing: it is still restarted, but after
            pauses of ``failing_pause_s``.
        window_s: Length of the window, seconds of the machine.
        failing_pause_s: Pause before each restart of a failing component.
        hung_after_s: Silence after which a ready process is ended and replaced, seconds of the machine.
    """

    restart: bool = True
    back_off_s: Duration = 0.05
    back_off_most_s: Duration = 2.0
    limit: Count = 20
    window_s: Duration = 60.0
    failing_pause_s: Duration = 10.0
    hung_after_s: Duration = 3.0


class Spawn(Message, frozen=True):
    """Start one component here and answer when it is ready. Only the placer asks this.

    Attributes:
        subsystem: Where it belongs.
        name: Unique in the mission.
        type: Component type.
        class_path: ``package.module:Class``.
        parameters: Values for its ``Parameters``.
        requester: Address of whoever wanted it.
        policy: What to do when it ends unexpectedly.
        ready_within_s: Silence, seconds of the machine, after which a start that is not ready has failed.
        pinned: True if it may run on this host only. Kept here, with the tags, for a placer that lost its memory.
        tags: Tags its host must have.
        process: Name of the process it shares with others on its host; empty: a process of its own.
    """

    subsystem: Subsystem
    name: Name
    type: Mention
    class_path: Line
    parameters: Values = {}
    requester: Mention = ""
    policy: RestartPolicy = RestartPolicy()
    ready_within_s: Duration = READY_WITHIN_S
    pinned: bool = False
    tags: Annotated[list[Mention], FEW] = []
    process: NameOrNone = ""


class Spawned(Message, frozen=True):
    """Answer to ``Spawn``: it is ready."""

    address: Mention
    pid: Pid


class EndProcess(Message, frozen=True):
    """End a component's whole process tree: ask, then SIGTERM, then SIGKILL.

    One that shares its process is asked, then told to end, and the others stay; if that does not help,
    the process is killed, and the others are restarted by their policies.

    Attributes:
        name: The component.
        reason: For the record.
        ask_s: Seconds of the machine it has after being asked.
        term_s: Seconds it has after SIGTERM.
    """

    name: Mention
    reason: Text = ""
    ask_s: Duration = 1.5
    term_s: Duration = 0.5


class EndedBy(StrEnum):
    """What it took to end a process."""

    ITSELF = "itself"
    ASKING = "asking"
    SIGTERM = "sigterm"
    SIGKILL = "sigkill"


class ProcessEnded(Message, frozen=True):
    """Answer to ``EndProcess``: nothing of it is left."""

    name: Mention
    by: EndedBy
    exit_code: ExitCode


class ListProcesses(Message, frozen=True):
    """What runs here?"""


class ProcessState(Message, frozen=True):
    """One component of this creator.

    Attributes:
        spawn: The order it was started by.
        pid: Its process now, 0 while it waits for a restart.
        restarts: How often it was restarted.
        last_end: How it ended last, for people; empty if it never did.
        silent_s: Seconds of the machine since its process last showed that its event loop runs; 0 while it is in time.
        doing: What a component that is not ready yet is doing, for people.
    """

    spawn: Spawn
    pid: Pid
    restarts: Count
    last_end: Text
    silent_s: Duration = 0.0
    doing: Text = ""


class Processes(Message, frozen=True):
    """Answer to ``ListProcesses``: the truth about this host, from which others rebuild their picture."""

    host: Mention
    tags: Annotated[list[Mention], FEW]
    processes: Annotated[list[ProcessState], MANY]


class HostLoad(Message, frozen=True):
    """Published by each creator as telemetry, once a second and on every change of its processes.

    Attributes:
        host: Name of the host.
        tags: Its tags.
        cpu: Busy share of all cores, 0 to 1.
        memory: Used share of memory, 0 to 1.
        cores: Number of cores.
        components: Number of components this creator runs.
    """

    host: Mention
    tags: Annotated[list[Mention], FEW]
    cpu: Share
    memory: Share
    cores: Count
    components: Count


class ProcessFell(Message, frozen=True):
    """Published as an event when a component ended unexpectedly.

    Attributes:
        name: The component.
        how: Exit code or signal, for people.
        restart_in_s: Pause before it is started again; negative if it is left down.
        last_lines: The end of its log.
        failing: True if it ended more often than its policy's limit.
    """

    name: Mention
    how: Text
    restart_in_s: Pause
    last_lines: Annotated[list[Text], FEW]
    failing: bool = False


class StartFailed(Refusal):
    """The component did not become ready; the detail is what it refused with, or else the end of its log.

    Facts: ``name``, ``how`` it ended, and ``refused``, the code of its own refusal if it was one.
    """

    code = "creator.start_failed"
    remedy = "Read the log lines; mend the component or its parameters and start it again."


class NotHere(Refusal):
    """No component of this name runs under this creator."""

    code = "creator.not_here"
    remedy = "Ask the placer where it runs."


class AlreadyHere(Refusal):
    """A component of this name runs, starts or ends under this creator, by another order."""

    code = "creator.already_here"
    remedy = "It runs already: see 'scout-backbone status'. Stop it first, or give the new one a name of its own."


class UnlistedType(Refusal):
    """The creator may not run this class: it was not launched with it in the list of the mission's types."""

    code = "creator.unlisted_type"
    remedy = "Declare the type in the mission file; core services are started by 'scout-backbone up' alone."


class FixedTypes(Refusal):
    """Which types a creator may run, and what it preloads, is settled by its launch."""

    code = "creator.fixed_types"
    remedy = "Change the types in the mission file, and bring the mission up again."


class NotThePlacer(Refusal):
    """Processes are started and ended by the placer alone, so that its picture stays true."""

    code = "creator.not_the_placer"
    remedy = "Ask the placer to start or stop the component."


CreatorQuestion = Spawn | EndProcess | ListProcesses


def creator_name(host: str) -> str:
    """Return the name of the creator on a host."""
    return f"creator-{host}"


def offer_name(host: str) -> str:
    """Return the name of the command that offers a host to a mission elsewhere, and keeps its creator."""
    return f"offer-{host}"
