"""Messages to a creator, and its reports."""

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
READY_WITHIN_S = 10.0  # chosen: of silence; a starting process beats while it imports, renders or waits for others
CUT_OFF_ENDS_WITHIN_S = 7.0  # chosen: 2 s until a link counts as cut, 3 s until its host ends all, 2 s to end
START_MOST_S = 180.0  # chosen: a start that is not ready by then has failed, even if it shows signs of life


class RestartPolicy(Message, frozen=True):
    """Rules by which the creator replaces a process that hangs or ended without an order.

    Attributes:
        restart: False: never; the owner must ask for a new start.
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


class DeclaredClass(Message, frozen=True):
    """Class and parameters that the mission file declares for a component whose class was exchanged."""

    class_path: Line
    parameters: Values = {}


class Spawn(Message, frozen=True):
    """Start one component here and answer when it is ready. Only the placer asks this.

    Attributes:
        name: Unique in the mission.
        class_path: ``package.module:Class``.
        parameters: Values for its ``Parameters``.
        requester: Address of the component's owner.
        ready_within_s: Silence, seconds of the machine, after which a start that is not ready has failed.
        pinned: True if it may run on this host only. A restarted placer learns this and the tags from the creator.
        tags: Tags that its host must have.
        process: Name of the shared process; empty: a process of its own.
        alike_most: Most components of its type in one process, where the placer chooses the process; 1: it does not.
        declared: Class and parameters to use if the component is placed anew; None: these.
        order_id: See ``Launch``.
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
    alike_most: Count = 1
    declared: DeclaredClass | None = None
    order_id: Mention = ""


class Spawned(Message, frozen=True):
    """Answer to ``Spawn``: the component is ready."""

    address: Mention
    pid: Pid


class ReviseSpawn(Message, frozen=True):
    """Start the component with these parameters from its next start on.

    Only the placer asks this, and the RC manager about itself.

    Attributes:
        parameters: All of them; the running process keeps its own.
        class_path: Class path from its next start on; empty: as before.
        declared: See ``Spawn``.
    """

    name: Name
    parameters: Values
    class_path: Line = ""
    declared: DeclaredClass | None = None


class SpawnRevised(Message, frozen=True):
    """Answer to ``ReviseSpawn``: each restart from now on uses the new parameters."""


class EndProcess(Message, frozen=True):
    """End a component's whole process tree: ask, then SIGTERM, then SIGKILL.

    A component in a shared process is asked, then ordered to end, and the other members continue. If it does not end,
    the process is killed, and the other members are restarted by their policies.

    Attributes:
        ask_s: Seconds of the machine from the request to SIGTERM.
        term_s: Seconds of the machine from SIGTERM to SIGKILL.
    """

    name: Mention
    reason: Text = ""
    ask_s: Duration = 1.5
    term_s: Duration = 0.5


class EndedBy(StrEnum):
    """The step that ended a process."""

    ITSELF = "itself"
    ASKING = "asking"
    SIGTERM = "sigterm"
    SIGKILL = "sigkill"


class ProcessEnded(Message, frozen=True):
    """Answer to ``EndProcess``: the whole process tree has ended."""

    name: Mention
    by: EndedBy
    exit_code: ExitCode


class ListProcesses(Message, frozen=True):
    """Ask for the processes of this creator."""


class ProcessState(Message, frozen=True):
    """One component of this creator, running or waiting for a restart.

    Attributes:
        spawn: The order that started it.
        pid: Its process, 0 while it waits for a restart.
        last_end: How it last ended, for people; empty if it never ended.
        silent_s: Seconds of the machine since the last heartbeat of its process; 0 while the heartbeat is in time.
        doing: Present step of a component that is not ready yet, for people.
    """

    spawn: Spawn
    pid: Pid
    restarts: Count
    last_end: Text
    silent_s: Duration = 0.0
    doing: Text = ""


class Processes(Message, frozen=True):
    """Answer to ``ListProcesses``, from which the placer rebuilds its book after a restart."""

    host: Mention
    tags: Annotated[list[Mention], FEW]
    processes: Annotated[list[ProcessState], MANY]


class AskLoad(Message, frozen=True):
    """Asks a creator for the load of its host; answer: ``HostLoad``."""


class HostLoad(Message, frozen=True):
    """Load of a host. Each creator publishes it once a second and after every change of its processes.

    Attributes:
        cpu: Busy share of all cores, 0 to 1.
        memory: Used share of memory, 0 to 1.
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
        how: Exit code or signal, for people.
        restart_in_s: Pause before the restart; negative: no restart.
        last_lines: Last lines of its log.
        failing: True if it ended more often than the limit of its policy.
    """

    name: Mention
    how: Text
    restart_in_s: Pause
    last_lines: Annotated[list[Text], FEW]
    failing: bool = False


class StartFailed(Refusal):
    """The component did not become ready; the detail is its refusal, or else the end of its log.

    Facts: ``name``, ``how`` it ended, and ``refused``, the code of its refusal, if it refused.
    """

    code = "creator.start_failed"
    remedy = "Read the log lines; correct the component or its parameters and start it again."


class NotHere(Refusal):
    """No component of this name runs under this creator."""

    code = "creator.not_here"
    remedy = "Ask the placer where it runs."


class AlreadyHere(Refusal):
    """Another order of this name is running, starting or ending under this creator."""

    code = "creator.already_here"
    remedy = "It runs already: see 'scout-backbone status'. Stop it first, or give the new one a name of its own."


class UnlistedType(Refusal):
    """The mission's types, which the creator got at its launch, do not contain this class."""

    code = "creator.unlisted_type"
    remedy = "Declare the type in the mission file; core services are started by 'scout-backbone up' alone."


class FixedTypes(Refusal):
    """The types and preloaded modules of a creator are set at its launch and cannot be changed."""

    code = "creator.fixed_types"
    remedy = "Change the types in the mission file, and bring the mission up again."


class NotThePlacer(Refusal):
    """Only the placer starts and ends processes, so that its book stays correct."""

    code = "creator.not_the_placer"
    remedy = "Ask the placer to start or stop the component."


CreatorQuestion = Spawn | ReviseSpawn | EndProcess | ListProcesses | AskLoad


def creator_name(host: str) -> str:
    """Return the name of the creator on a host."""
    return f"creator-{host}"


def offer_name(host: str) -> str:
    """Return the component name of the command that offers a host to a mission and keeps its creator."""
    return f"offer-{host}"
