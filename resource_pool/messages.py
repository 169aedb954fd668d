"""Messages of the resource pool and of its client interface, the ARCs.

* decision process → ARC: ``ArcQuestion``, and the commands of its kind (``commands``); ARC → decision process:
  ``ArcNotice``.
* robot RC → command radio RC: ``LoadPacket``; command radio RC → robot RCs: ``Reply``, published.
* robot RC → everybody: ``Readings``, published when they change, and the answer to ``AskReadings``; its motions, see
  ``published_motions``.
* framegrabber RC → subscribers of its ARC: ``Frame``, published under the ARC's address.
"""

from __future__ import annotations

from typing import Annotated

from backbone.errors import Refusal
from backbone.ranges import (
    FEW,
    Count,
    Duration,
    Epoch,
    Instant,
    Measure,
    Mention,
    Payload,
    PictureSide,
    Pixels,
    RunTime,
    Text,
    Values,
)
from backbone.scheduling.requests import Usage
from backbone.wire import Message

# Decision process → ARC.


class GiveCommand(Message, frozen=True):
    """Send a command by its word, for owners that do not know its class.

    Attributes:
        word: Word of one of the ARC's commands.
        values: Field → value; fields left out have their defaults.
        role: Role of the RC that obeys it; empty: the only one.
        after_stop: Number of the robot's last stop whose lift the sender knows; 0: no stop.
    """

    word: Mention
    values: Values = {}
    role: Mention = ""
    after_stop: Count = 0


class WantIdle(Message, frozen=True):
    """Want no time (True), or want time again (False)."""

    idle: bool


class WantRuntime(Message, frozen=True):
    """Request other run times from the next slice on."""

    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime = 0.0


class WantLonger(Message, frozen=True):
    """Extend the present slice until this mission time."""

    until_s: Instant


class Release(Message, frozen=True):
    """Release this ARC: it withdraws its request, frees its RCs and ends."""

    reason: Text = ""


class AskArc(Message, frozen=True):
    """Ask for the state of an ARC."""


class ArcState(Message, frozen=True, tag="ArcState/2"):
    """Answer to ``AskArc``.

    Attributes:
        arc: Name of the ARC.
        kind: Its type.
        owner: Address of its decision process.
        rcs: Role → name of the chosen RCs; empty until they are chosen.
        granted: True while commands pass.
        epochs: RC name → epoch while granted.
        reason: Why it is swapped out, empty while granted.
        by: The ARC or operator that caused it.
        expected_start_s: Next expected slot, mission time; negative: unknown.
        robot: The RC in ``rcs`` that has a body; empty: none.
    """

    arc: Mention
    kind: Mention
    owner: Mention
    rcs: Annotated[dict[Mention, Mention], FEW]
    granted: bool
    epochs: Annotated[dict[Mention, Epoch], FEW]
    reason: Text
    by: Mention
    expected_start_s: Instant
    robot: Mention = ""


class Accepted(Message, frozen=True):
    """Answer to a request that has no result."""


class Applied(Message, frozen=True):
    """The effect of a command at an RC.

    Attributes:
        rc: The RC.
        epoch: Epoch of the grant.
        at_s: Mission time.
        command: The command's ``word``.
        values: Applied values, clipped to the hardware's limits, with units in their names.
        number: Of the motions that the RC has published: 1 for the first; 0 in answers.
    """

    rc: Mention
    epoch: Epoch
    at_s: Instant
    command: Mention
    values: Annotated[dict[Mention, Measure], FEW] = {}
    number: Count = 0


ArcQuestion = GiveCommand | WantIdle | WantRuntime | WantLonger | Release | AskArc


# ARC → decision process.


class Resumed(Message, frozen=True, tag="Resumed/2"):
    """The RCs are granted: commands pass from now on.

    Attributes:
        arc: The ARC.
        rcs: Role → name of the RCs.
        epochs: RC name → epoch.
        until_s: Mission time until which the slice lasts at least.
        robot: The RC in ``rcs`` that has a body; empty: none.
    """

    arc: Mention
    rcs: Annotated[dict[Mention, Mention], FEW]
    epochs: Annotated[dict[Mention, Epoch], FEW]
    until_s: Instant
    robot: Mention = ""


class SliceEnds(Message, frozen=True):
    """Ask whether the slice may end at this time. Only owners that may answer "not now" get this question.

    Attributes:
        arc: The ARC.
        until_s: Mission time at which the slice may end.
        most_s: Mission time until which it can be extended.
    """

    arc: Mention
    until_s: Instant
    most_s: Instant


class Suspending(Message, frozen=True):
    """The slice ends: stop cleanly, then answer."""

    arc: Mention
    reason: Text
    by: Mention
    deadline_s: Instant


class Suspended(Message, frozen=True):
    """The grant has ended: commands are refused until the next ``Resumed``."""

    arc: Mention
    reason: Text
    by: Mention
    expected_start_s: Instant


class AskBeat(Message, frozen=True):
    """Heartbeat question to the owner.

    Attributes:
        state: The ARC's state, which corrects an owner whose notice is late or lost.
    """

    state: ArcState | None = None


class Noted(Message, frozen=True):
    """Answer to every notice.

    Attributes:
        wanted_s: For ``SliceEnds``: estimated seconds still needed beyond that end ("not now"); 0: none.
    """

    wanted_s: Duration = 0.0


ArcNotice = Resumed | SliceEnds | Suspending | Suspended | AskBeat


# ARC → RCs.


class LoadPacket(Message, frozen=True, tag="LoadPacket/2"):
    """Send this packet. Robot RCs ask this under the radio's grant to their ARC.

    Attributes:
        arc: The ARC that holds robot and radio.
        epoch: Epoch of the radio RC's connection.
        network_id: Network id of the robot.
        payload: Bytes of the robot's own protocol.
        safe_payload: The robot's last packet when the ARC is disconnected.
        robot_epoch: Epoch of the robot RC's connection, for the audit.
        at_once: True: sent once, in the next turn of its stream; the answer follows when it is on the air. False:
            repeated at its stream's rate from now on, until replaced.
        lasts_s: With ``at_once`` False: mission seconds after which ``afterwards`` replaces it; 0: never.
            A robot RC that hangs must not keep its robot moving through the radio.
        afterwards: The packet that is repeated after this one; empty: the one before it.
        kind: Kind of its stream; the ARC's first stream if the ARC has none of this kind.
        moves: True: it moves the robot. It is not sent once a packet of a later stop was loaded.
        robot_stop: Number of the robot's last stop when the packet was made.
        answers: True: the robot's replies can be decoded, so a radio that can receive replies asks for them.
    """

    arc: Mention
    epoch: Epoch
    network_id: Count
    payload: Payload
    safe_payload: Payload
    robot_epoch: Epoch
    at_once: bool = False
    afterwards: Payload = b""
    lasts_s: Duration = 0.0
    kind: Mention = "drive"
    moves: bool = False
    robot_stop: Count = 0
    answers: bool = False


class PacketLoaded(Message, frozen=True):
    """Answer to ``LoadPacket``: the packet is loaded; with ``at_once``, it is sent."""


class Reply(Message, frozen=True):
    """A robot's reply, published under the address of the radio that received it.

    Attributes:
        network_id: Network id of the robot.
        payload: Bytes of the robot's own protocol.
    """

    network_id: Count
    payload: Payload


class AskReadings(Message, frozen=True):
    """Ask an RC for its newest readings."""


class Readings(Message, frozen=True):
    """The newest measurements of an RC's hardware.

    Attributes:
        rc: The RC.
        at_s: Mission time at which the RC got them; negative: never.
        values: Field of the RC's ``reports`` → number or flag.
    """

    rc: Mention
    at_s: Instant
    values: Annotated[dict[Mention, Measure | bool], FEW] = {}


class NothingHeard(Message, frozen=True):
    """A framegrabber receives no transmitter; sent to the ARC that holds the framegrabber.

    Attributes:
        rc: The framegrabber.
        epoch: Epoch of its connection.
    """

    rc: Mention
    epoch: Epoch


class Frame(Message, frozen=True):
    """One picture.

    Attributes:
        rc: The framegrabber.
        arc: The ARC that holds it.
        epoch: Epoch of the framegrabber's connection; receivers drop pictures of other epochs.
        robot: Robot whose transmitter is expected on the frequency (chosen with the grant).
        number: Grows by one with each frame of this connection.
        captured_s: Mission time of the capture.
        width_px: Columns.
        height_px: Rows.
        pixels: Grey levels, row by row from the top; ``width_px`` times ``height_px`` of them.
    """

    rc: Mention
    arc: Mention
    epoch: Epoch
    robot: Mention
    number: Count
    captured_s: Instant
    width_px: PictureSide
    height_px: PictureSide
    pixels: Pixels

    def __post_init__(self) -> None:
        if self.width_px * self.height_px != len(self.pixels):  # the decoder refuses it as malformed
            raise ValueError(f"{len(self.pixels)} pixels for {self.width_px} x {self.height_px}")


# Refusals.


class SwappedOut(Refusal):
    """The ARC has no grant; facts: ``reason``, ``by``, ``expected_start_s``."""

    code = "arc.swapped_out"
    remedy = "Wait until it is granted again; 'scout-backbone why' predicts when."


class NotMySet(Refusal):
    """The order to open names RCs that are not in the ARC's request."""

    code = "arc.not_my_set"
    remedy = "Connect the RCs of one of the alternatives in the ARC's request."


class NoSuchAction(Refusal):
    """This kind of ARC has no RC for the command."""

    code = "arc.no_such_action"
    remedy = "Claim a kind of ARC that declares this command, and whose set has the RC for it."


class NotYours(Refusal):
    """Only its decision process may command an ARC."""

    code = "arc.not_yours"
    remedy = "Claim an ARC of your own."


class NotFromYou(Refusal):
    """Only the RC manager grants and revokes RCs, and only the holder commands an RC. Nothing is changed."""

    code = "rc.not_from_you"
    remedy = "Claim an ARC and command through it; the RC manager connects its RCs when its turn comes."


class NeedsRestart(Refusal):
    """The parameter exists, but a running component cannot change it. Nothing is changed."""

    code = "rc.needs_restart"
    remedy = "Change it in the mission file; the component uses it from its next start on."


class ImpossibleUse(Refusal):
    """The epoch, lease or use of a connection is impossible."""

    code = "rc.impossible_use"
    remedy = "Connect with the next epoch, a lease of at most an hour, and periods that are finite and above 0."


class NoTurnSoon(Refusal):
    """The ARC's stream on the radio is too slow for an urgent packet, which was not sent; fact: ``wait_s``."""

    code = "radio.no_turn_soon"
    remedy = "Claim with a shorter period, or with a further usage for this kind of command."


DEFAULT_DRIVE_USAGE = Usage(period_s=0.05, packet_time_s=0.002, kind="drive")
"""Chosen: 20 commands a second are enough for manual control; 2 ms is 24 bytes at 115.2 kbit/s."""

COMMAND_TIMEOUT_S = 0.5  # chosen: about a keyboard's repeat delay; a robot stops within a body length
