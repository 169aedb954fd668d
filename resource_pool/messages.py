"""Messages of the resource pool and of its client interface, the ARCs.

* decision process → ARC: ``ArcQuestion``; ARC → decision process: ``ArcNotice``.
* ARC → scout RC: ``ScoutCommand``; scout RC → command radio RC: ``RadioCommand``; ARC → framegrabber RC: ``Tune``.
* framegrabber RC → subscribers of its ARC: ``Frame``, published under the ARC's address.
* operator → robot RC, past ARC and RC manager: ``EmergencyQuestion``; robot RC → subscribers: ``StopState``.

Commands to RCs are questions: the answer contains the applied values, or is the refusal ``StaleEpoch``.
"""

from __future__ import annotations

from typing import Annotated

from backbone.errors import Refusal
from backbone.ranges import (
    FEW,
    MANY,
    Count,
    Document,
    Duration,
    Epoch,
    Instant,
    Line,
    Measure,
    Mention,
    Meters,
    Number,
    Payload,
    PixelCount,
    Pixels,
    Radians,
    Rate,
    RunTime,
    Share,
    StateVector,
    Text,
    WheelSpeed,
)
from backbone.scheduling.requests import Usage
from backbone.wire import Message
from scout_model.description import AirDescription


# ---------------------------------------------------------------------- decision process → ARC
class Drive(Message, frozen=True):
    """Turn the wheels at these speeds from now on, until another command or ``COMMAND_TIMEOUT_S``.

    Attributes:
        left_rad_s: Left wheel, forward is positive.
        right_rad_s: Right wheel.
        after_stop: Number of the robot's last stop whose lift the sender knows; 0: no stop.
    """

    left_rad_s: WheelSpeed
    right_rad_s: WheelSpeed
    after_stop: Count = 0


class Halt(Message, frozen=True):
    """Stop the wheels."""


class Jump(Message, frozen=True):
    """Wind the spring foot and kick.

    Attributes:
        after_stop: As for ``Drive``.
    """

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


class ArcState(Message, frozen=True):
    """Answer to ``AskArc``.

    Attributes:
        arc: Name of the ARC.
        kind: Its type.
        owner: Address of its decision process.
        rcs: Kind → name of the chosen RCs; empty until they are chosen.
        granted: True while commands pass.
        epochs: RC name → epoch while granted.
        reason: Why it is swapped out, empty while granted.
        by: The ARC or operator that caused it.
        expected_start_s: Next expected slot, mission time; negative: unknown.
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


class Accepted(Message, frozen=True):
    """Answer to questions without a result."""


class Applied(Message, frozen=True):
    """The effect of a command at an RC.

    Attributes:
        rc: The RC.
        epoch: Epoch of the grant.
        at_s: Mission time.
        command: ``drive``, ``halt``, ``jump``, ``transmitter``.
        values: Applied values, clipped to the hardware's limits, with units in their names.
    """

    rc: Mention
    epoch: Epoch
    at_s: Instant
    command: Mention
    values: Annotated[dict[Mention, Measure], FEW] = {}


ArcQuestion = Drive | Halt | Jump | WantIdle | WantRuntime | WantLonger | Release | AskArc


# ---------------------------------------------------------------------- ARC → decision process
class Resumed(Message, frozen=True):
    """The RCs are granted: commands pass from now on.

    Attributes:
        arc: The ARC.
        rcs: Kind → name of the RCs.
        epochs: RC name → epoch.
        until_s: Mission time until which the slice lasts at least.
    """

    arc: Mention
    rcs: Annotated[dict[Mention, Mention], FEW]
    epochs: Annotated[dict[Mention, Epoch], FEW]
    until_s: Instant


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


# ---------------------------------------------------------------------- ARC → RCs
class CommandScout(Message, frozen=True):
    """A command to a robot under a grant.

    Attributes:
        arc: The ARC that commands.
        epoch: Epoch of the scout RC's connection.
        command: The command.
    """

    arc: Mention
    epoch: Epoch
    command: Drive | Halt | Jump | SwitchTransmitter


class SwitchTransmitter(Message, frozen=True):
    """Switch the robot's video transmitter on at a frequency, or off.

    Attributes:
        on: On or off.
        frequency: Name of the video frequency's RC; empty when off.
    """

    on: bool
    frequency: Mention = ""


class LoadPacket(Message, frozen=True):
    """Send this packet. Robot RCs ask this under the radio's grant to their ARC.

    Attributes:
        arc: The ARC that holds robot and radio.
        epoch: Epoch of the radio RC's connection.
        network_id: Network id of the robot.
        payload: Bytes of the robot's own protocol.
        safe_payload: The robot's last packet when the ARC is disconnected.
        robot_epoch: Epoch of the robot RC's connection, for the audit.
        at_once: True: once, in the next turn of its stream, answered when it is on the air.
            False: at its stream's rate from now on, until replaced.
        lasts_s: With ``at_once`` False: mission seconds after which ``afterwards`` replaces it; 0: never.
            A robot RC that hangs must not keep its robot moving through the radio.
        afterwards: The packet that is repeated after this one; empty: the one before it.
        kind: Kind of its stream; the ARC's first stream if the ARC has none of this kind.
        moves: True: it moves the robot, and is not sent after a packet of a later stop was loaded.
        robot_stop: Number of the robot's last stop when the packet was made.
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


class PacketLoaded(Message, frozen=True):
    """Answer to ``LoadPacket``: the packet is loaded, and sent if ``at_once``."""


class Tune(Message, frozen=True):
    """Receive this video frequency and deliver its pictures to the ARC that holds the framegrabber.

    Attributes:
        arc: The ARC.
        epoch: Of the framegrabber's connection.
        frequency: Name of the video frequency's RC.
        robot: The robot of the ARC; pictures of other robots are not delivered. Empty: any.
    """

    arc: Mention
    epoch: Epoch
    frequency: Mention
    robot: Mention = ""


class NothingHeard(Message, frozen=True):
    """A framegrabber receives no transmitter; sent to the ARC that holds it.

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
    width_px: PixelCount
    height_px: PixelCount
    pixels: Pixels

    def __post_init__(self) -> None:
        if self.width_px * self.height_px != len(self.pixels):  # the decoder refuses it as malformed
            raise ValueError(f"{len(self.pixels)} pixels for {self.width_px} x {self.height_px}")


# ---------------------------------------------------------------------- operator → robot RC: needs no grant
class EmergencyStop(Message, frozen=True):
    """Stop this robot; nothing moves it until the stop is lifted. Every operator may stop it at any time.

    Attributes:
        reason: Reason, for the holder and the log.
        user: Name of the operator, for people; empty: the console.
    """

    reason: Line = ""
    user: Mention = ""


class LiftStop(Message, frozen=True):
    """Let the robot move again.

    Attributes:
        number: Number of the stop that the operator saw; a newer stop is not lifted.
        user: Name of the operator, for people; empty: the console.
    """

    number: Count
    user: Mention = ""


class AskStop(Message, frozen=True):
    """Ask whether this robot is stopped."""


class Stopper(Message, frozen=True):
    """An operator who stopped a robot.

    Attributes:
        by: Name of the operator, for people; without a name the address of the console.
        console: Address of the operator's console, which is asked before the stop is lifted. Empty: unknown.
    """

    by: Mention
    console: Mention = ""


class StopState(Message, frozen=True):
    """Answer to the three questions before; also published as an event on every change.

    Attributes:
        rc: The robot.
        is_stopped: True: drives and jumps are refused.
        number: Number of the last order to stop; grows with each, also if the robot was stopped already.
        by: The operator who stopped it first, or who lifted the last stop.
        reason: The operator's reason.
        at_s: Mission time of the stop, or of its end.
        is_confirmed: False if the radio did not accept the packet that stops the wheels. Then no new packet moves the
            robot, and its present motion ends by itself within ``COMMAND_TIMEOUT_S``.
        console: Address of the console of the operator ``by``.
        also: Other operators who stopped it since it last moved.
    """

    rc: Mention
    is_stopped: bool
    number: Count
    by: Mention
    reason: Text
    at_s: Instant
    is_confirmed: bool = True
    console: Mention = ""
    also: Annotated[list[Stopper], FEW] = []


EmergencyQuestion = EmergencyStop | LiftStop | AskStop


# ---------------------------------------------------------------------- the simulated world, played as hardware
class RadioPacket(Message, frozen=True):
    """A packet on the air: published under the world's address as a command, without an acknowledgment.

    Attributes:
        radio: Its sender.
        network_id: Network id of its receiver.
        payload: Bytes of the robot's protocol.
        arc: For the audit: the ARC that held robot and radio.
        epoch: For the audit: epoch of the robot when the payload was made.
        number: Its number among the packets of its radio since the radio was opened.
        air_time_s: Duration of its bits.
        robot_stop: For the audit: number of the robot's last stop when the payload was made.
    """

    radio: Mention
    network_id: Count
    payload: Payload
    arc: Mention = ""
    epoch: Epoch = 0
    number: Count = 0
    air_time_s: Duration = 0.0
    robot_stop: Count = 0


class AskWorld(Message, frozen=True):
    """Ask for the model of the world."""


class WorldModel(Message, frozen=True):
    """Answer to ``AskWorld``: all that another process needs to draw and receive the same pictures.

    Attributes:
        mjcf: The compiled world's XML.
        robots: Robot name → network id.
        seed: Seed of all random processes of the world.
        air: The air between robots and base.
        antenna_m: Position of the base's antenna: x, y, z.
    """

    mjcf: Document
    robots: Annotated[dict[Mention, Count], MANY]
    seed: Number = 0
    air: AirDescription = AirDescription()
    antenna_m: tuple[Meters, Meters, Meters] = (0.0, 0.0, 1.0)


class AskPose(Message, frozen=True):
    """Ask for the pose of a body. The simulated world or a camera above the room knows it; a robot does not."""

    body: Mention


class Pose(Message, frozen=True):
    """Answer to ``AskPose``: metres and radians in the room's frame, origin in a corner of the floor."""

    body: Mention
    at_s: Instant
    x_m: Meters
    y_m: Meters
    heading_rad: Radians


class WorldState(Message, frozen=True):
    """State of the world, published once a frame as telemetry.

    Attributes:
        frame: Number of the frame.
        at_s: Mission time of the state.
        state: float64 vector, little endian; only the model knows its meaning.
        transmitting: Robot → video frequency of its transmitter, if it is on.
        on_since: Robot that transmits → first frame on this frequency.
        motors: Robot that transmits → speed of its wheels, 0 to 1 of their limit; a missing robot stands still.
    """

    frame: Count
    at_s: Instant
    state: StateVector
    transmitting: Annotated[dict[Mention, Mention], MANY]
    on_since: Annotated[dict[Mention, Count], MANY] = {}
    motors: Annotated[dict[Mention, Share], MANY] = {}


class ClockTick(Message, frozen=True):
    """The mission's time, published by the world once a frame, for hosts without a shared monotonic clock."""

    frame: Count
    at_s: Instant
    rate: Rate


# ---------------------------------------------------------------------- refusals
class SwappedOut(Refusal):
    """The ARC has no grant; facts: ``reason``, ``by``, ``expected_start_s``."""

    code = "arc.swapped_out"
    remedy = "Wait until it is granted again; 'scout-backbone why' predicts when."


class NotMySet(Refusal):
    """The order to open names RCs that are not in the ARC's request."""

    code = "arc.not_my_set"
    remedy = "Connect the RCs of one of the alternatives in the ARC's request."


class NoSuchAction(Refusal):
    """This kind of ARC has no RC for the action."""

    code = "arc.no_such_action"
    remedy = "Claim a kind of ARC that has the RC for it (see docs/reference/arcs.md)."


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


class EmergencyStopped(Refusal):
    """An operator has stopped the robot; it did not move.

    Facts: ``rc``, ``number``, ``is_stopped``, ``by``, ``reason``, ``since_s``.
    """

    code = "scout.emergency_stop"
    remedy = "See that the robot may move, then lift the stop at a console; the grant is not lost meanwhile."


class GivenBeforeStop(EmergencyStopped):
    """The sender did not know the robot's last stop, which was lifted since; facts as ``EmergencyStopped``."""

    code = "scout.given_before_stop"
    remedy = "Give the command again, now that you know of the stop: let go of the control and press it again."


class OtherStop(Refusal):
    """Another stop than the one to lift is in force; facts: ``number``, ``by``. Nothing is changed."""

    code = "scout.other_stop"
    remedy = "See which operator stopped the robot since, and lift that stop if the robot may move."


class NoTurnSoon(Refusal):
    """The ARC's stream on the radio is too slow for an urgent packet, which was not sent; fact: ``wait_s``."""

    code = "radio.no_turn_soon"
    remedy = "Claim with a shorter period, or with a further usage for this kind of command."


class HardwareFault(Refusal):
    """The hardware did not obey; the RC reports itself down."""

    code = "rc.hardware"
    remedy = "Check cable, power and driver of the resource."


DEFAULT_DRIVE_USAGE = Usage(period_s=0.05, packet_time_s=0.002, kind="drive")
"""Chosen: 20 commands a second suffice for a hand on a stick; 2 ms is 24 bytes at 115.2 kbit/s."""

COMMAND_TIMEOUT_S = 0.5  # chosen: about a keyboard's repeat delay; a robot stops within a body length
