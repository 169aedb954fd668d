"""What a process that several components share can be asked. Only the creator that started it asks.

A component that lives in such a process is its *member*. Each admission has a number of its own, its
*life*: a name that is admitted again after its end begins another life.
"""

from __future__ import annotations

from backbone.component.launch import Launch
from backbone.errors import Refusal
from backbone.naming import IllegalName, Subsystem
from backbone.ranges import Count, ExitCode
from backbone.wire import Message

PROCESSES = f"{Subsystem.BACKBONE}/*/*/*"
"""Addresses of all shared processes, for watching their tokens: one rises when its process can be asked."""


class Admit(Message, frozen=True):
    """Begin to be this component too. May be asked twice for the same life.

    Attributes:
        launch: As for a process of its own.
        life: Number of this admission, never given before by this creator.
    """

    launch: Launch
    life: Count


class Admitted(Message, frozen=True):
    """Answer to ``Admit``: it has begun. Whether it becomes ready, its own token tells."""


class AwaitEnd(Message, frozen=True):
    """How does this life end? Answered when it has ended, be it long ago."""

    life: Count


class MemberEnded(Message, frozen=True):
    """Answer to ``AwaitEnd``: nothing of it is left in the process.

    Attributes:
        exit_code: What a process of its own would have exited with.
    """

    life: Count
    exit_code: ExitCode


class EndMember(Message, frozen=True):
    """End this member in good order, as SIGTERM would end a process of its own. May be asked twice."""

    life: Count


class MemberEnding(Message, frozen=True):
    """Answer to ``EndMember``: it was told, or has ended."""


class NeedsOwnProcess(Refusal):
    """A component of this class prepares its process before there is a bus, or brings a bus of its own."""

    code = "component.own_process"
    remedy = "Remove the attribute 'process' from it in the mission file."


class AlreadyMember(Refusal):
    """A component of this name lives in the process, by another admission."""

    code = "component.already_member"
    remedy = "End it first."


class NotAMember(Refusal):
    """No life of this number was ever begun in this process."""

    code = "component.not_a_member"
    remedy = "Admit the component."


class NotItsCreator(Refusal):
    """Members come and go by the word of the creator that started the process, so that its picture stays true."""

    code = "component.not_its_creator"
    remedy = "Ask the placer to start or stop the component."


class AskedAgain(Refusal):
    """The end of this life was asked for once more; only the newest question is answered when it comes."""

    code = "component.asked_again"
    remedy = "Nothing to do: the newer question waits."


ProcessQuestion = Admit | AwaitEnd | EndMember


def process_address(host: str, process: str, pid: int) -> str:
    """Return the address at which one shared process is asked.

    It names the process itself, not only its role: what is asked of one that died never reaches its successor.

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
        IllegalName: It is the address of something else.
    """
    match address.split("/"):
        case [Subsystem.BACKBONE, host, process, pid] if pid.isdecimal():
            return host, process, int(pid)
        case _:
            raise IllegalName(f"{address!r} is not the address of a shared process")
