"""Messages to a shared process. Only the creator that started the process sends them.

A component in such a process is its *member*. Each admission has a number, its *life*. If a name is admitted again
after its end, another life begins.
"""

from __future__ import annotations

from backbone.component.launch import Launch
from backbone.errors import Refusal
from backbone.naming import IllegalName, Subsystem
from backbone.ranges import Count, ExitCode
from backbone.wire import Message

PROCESSES = f"{Subsystem.BACKBONE}/*/*/*"
"""Addresses of all shared processes, for watching their tokens; a process declares its token when it serves."""


class BeginMember(Message, frozen=True):
    """Admit this component. Idempotent for the same life.

    Attributes:
        life: Number of this admission, unique for this creator.
    """

    launch: Launch
    life: Count


class MemberBegun(Message, frozen=True):
    """Answer to ``BeginMember``: the member's life has begun. When it is ready, it declares its own token."""


class AwaitEnd(Message, frozen=True):
    """Ask for the end of this life. Answered when it has ended, also if it ended long ago."""

    life: Count


class MemberEnded(Message, frozen=True):
    """Answer to ``AwaitEnd``: the member has ended.

    Attributes:
        exit_code: Exit code that a process of its own would have had.
    """

    life: Count
    exit_code: ExitCode


class EndMember(Message, frozen=True):
    """End this member in good order, as SIGTERM would end a process of its own. Idempotent."""

    life: Count


class MemberEnding(Message, frozen=True):
    """Answer to ``EndMember``: the member is ending or has ended."""


class NeedsOwnProcess(Refusal):
    """A component of this class prepares its process before the bus is open, or opens a bus of its own."""

    code = "component.own_process"
    remedy = "Remove the attribute 'process' from it in the mission file."


class AlreadyMember(Refusal):
    """A component of this name lives in the process, by another admission."""

    code = "component.already_member"
    remedy = "End the member first."


class NotAMember(Refusal):
    """This process never admitted a life of this number."""

    code = "component.not_a_member"
    remedy = "Admit the component."


class NotItsCreator(Refusal):
    """Only the creator that started the process admits and ends members, so that its records stay correct."""

    code = "component.not_its_creator"
    remedy = "Ask the placer to start or stop the component."


class AskedAgain(Refusal):
    """A newer question waits for the end of this life; only the newest one is answered."""

    code = "component.asked_again"
    remedy = "Nothing to do: the newer question waits."


ProcessQuestion = BeginMember | AwaitEnd | EndMember


def process_address(host: str, process: str, pid: int) -> str:
    """Return the address of a shared process.

    It contains the pid, so that a question to a dead process never reaches its successor.

    Example:
        >>> process_address("lab-pc", "pool", 4242)
        'backbone/lab-pc/pool/4242'
    """
    return f"{Subsystem.BACKBONE}/{host}/{process}/{pid}"


def read_process_address(address: str) -> tuple[str, str, int]:
    """Return host, name and pid of a shared process.

    Example:
        >>> read_process_address("backbone/lab-pc/pool/4242")
        ('lab-pc', 'pool', 4242)

    Raises:
        IllegalName: The text is no address of a shared process.
    """
    match address.split("/"):
        case [Subsystem.BACKBONE, host, process, pid] if pid.isdecimal():
            return host, process, int(pid)
        case _:
            raise IllegalName(f"{address!r} is not the address of a shared process")
