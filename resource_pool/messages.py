"""What is said inside the resource pool and at its one door, the ARCs.

* decision process → ARC: ``ArcQuestion``; ARC → decision process: ``ArcNotice``.
* ARC → scout RC: ``ScoutCommand``; scout RC → command radio RC: ``RadioCommand``; ARC → framegrabber RC: ``Tune``.
* framegrabber RC → whoever listens to its ARC: ``Frame``, published under the ARC's address.
* operator → robot RC, past ARC and RC manager: ``EmergencyQuestion``; robot RC → whoever listens: ``StopState``.

Commands to RCs are questions: each is answered with what was applied, or refused with ``StaleEpoch``.
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
        after_stop: Number of the robot's last stop that whoever says this knows to be lifted; 0: of none.
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
    """Nothing to do now (True), or time is wanted again (False)."""

    idle: bool


class WantRuntime(Message, frozen=True):
    """Other run times from the next slice on."""

    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime = 0.0


class WantLonger(Message, frozen=True):
    """Let the running slice last until this mission time."""

    until_s: Instant


class Release(Message, frozen=True):
    """Done with this ARC: it withdraws, frees its RCs and ends."""

    reason: Text = ""


class AskArc(Message, frozen=True):
    """What do you hold?"""


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
        by: Because of whom.
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
    """Answer to questions that need no other: done."""


class Applied(Message, frozen=True):
    """What an RC really did with a command.

    Attributes:
        rc: The RC.
        epoch: Under which grant.
        at_s: Mission time.
        command: ``drive``, ``halt``, ``jump``, ``transmitter``.
        values: Values after clipping to the hardware's limits, units in the names.
    """

    rc: Mention
    epoch: Epoch
    at_s: Instant
    command: Mention
    values: Annotated[dict[Mention, Measure], FEW] = {}


ArcQuestion = Drive | Halt | Jump | WantIdle | WantRuntime | WantLonger | Release | AskArc


# ---------------------------------------------------------------------- ARC → decision process
class Resumed(Message, frozen=True):
    """The RCs are yours: commands pass from now on.

    Attributes:
        arc: The ARC.
        rcs: Kind → name of what you hold.
        epochs: RC name → epoch.
        until_s: The slice lasts at least until this mission time.
    """

    arc: Mention
    rcs: Annotated[dict[Mention, Mention], FEW]
    epochs: Annotated[dict[Mention, Epoch], FEW]
    until_s: Instant


class SliceEnds(Message, frozen=True):
    """The slice may end then: is that a bad moment? Asked only of owners that said they may answer "not now".

    Attributes:
        arc: The ARC.
        until_s: Mission time at which the slice may end.
        most_s: Mission time until which it can be made longer.
    """

    arc: Mention
    until_s: Instant
    most_s: Instant


class Suspending(Message, frozen=True):
    """The slice ends: stop cleanly; answering means you have."""

    arc: Mention
    reason: Text
    by: Mention
    deadline_s: Instant


class Suspended(Message, frozen=True):
    """The RCs are gone: commands are refused until the next ``Resumed``."""

    arc: Mention
    reason: Text
    by: Mention
    expected_start_s: Instant


class AskBeat(Message, frozen=True):
    """Does your loop run?

    Attributes:
        state: How the ARC is, so that an owner that was told otherwise knows better: a notice may come late.
    """

    state: ArcState | None = None


class Noted(Message, frozen=True):
    """Answer to every notice.

    Attributes:
        wanted_s: To ``SliceEnds``: seconds still needed beyond that end ("not now"), an estimate; 0: none.
    """

    wanted_s: Duration = 0.0


ArcNotice = Resumed | SliceEnds | Suspending | Suspended | AskBeat


# ---------------------------------------------------------------------- ARC → RCs
class CommandScout(Message, frozen=True):
    """A command to a robot under a grant.

    Attributes:
        arc: Who commands.
        epoch: Of the scout RC's connection.
        command: What to do.
    """

    arc: Mention
    epoch: Epoch
    command: Drive | Halt | Jump | SwitchTransmitter


class SwitchTransmitter(Message, frozen=True):
    """Turn the robot's video transmitter on at a frequency, or off.

    Attributes:
        on: On or off.
        frequency: Name of the video frequency's RC; empty when off.
    """

    on: bool
    frequency: Mention = ""


class LoadPacket(Message, frozen=True):
    """Send this packet. Asked by robot RCs under the radio's grant to their ARC.

    Attributes:
        arc: The ARC that holds robot and radio.
        epoch: Of the radio RC's connection.
        network_id: Of the robot.
        payload: Bytes of the robot's own protocol.
        safe_payload: What is sent last of all to this robot when the ARC is disconnected.
        robot_epoch: Of the robot RC's connection, for the audit.
        at_once: True: once, in the next turn of its stream, answered when it is on the air.
            False: at its stream's rate from now on, until replaced.
        lasts_s: With ``at_once`` False: mission seconds after which ``afterwards`` replaces it; 0: none do.
            A robot RC that hangs must not keep its robot moving through the radio.
        afterwards: What is repeated after the packet was sent once, or has lasted its time; empty: what was before.
        kind: Which of the ARC's streams on the radio it is sent in; if it has none of that kind: its first.
        moves: True: it moves the robot; it is not sent once a packet of a later stop was loaded.
        robot_stop: Number of the robot's last stop when this was made.
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
    """Answer to ``LoadPacket``: it stands, and was sent if that was asked."""


class Tune(Message, frozen=True):
    """Receive this video frequency and hand its pictures to the ARC that holds the framegrabber.

    Attributes:
        arc: The ARC.
        epoch: Of the framegrabber's connection.
        frequency: Name of the video frequency's RC.
        robot: The one whose transmitter the ARC holds; pictures of another are not delivered. Empty: any.
    """

    arc: Mention
    epoch: Epoch
    frequency: Mention
    robot: Mention = ""


class NothingHeard(Message, frozen=True):
    """The transmitter of your robot is silent; said by a framegrabber to the ARC that holds it.

    Attributes:
        rc: The framegrabber.
        epoch: Of its connection.
    """

    rc: Mention
    epoch: Epoch


class Frame(Message, frozen=True):
    """One picture.

    Attributes:
        rc: Framegrabber that took it.
        arc: ARC it was taken for.
        epoch: Of the framegrabber's connection; receivers drop those of other epochs.
        robot: Robot whose transmitter is expected on the frequency (chosen with the grant).
        number: Grows by one with each frame of this connection.
        captured_s: Mission time at which it was taken.
        width_px: Columns.
        height_px: Rows.
        pixels: Grey levels, row by row from the top; as many as rows and columns have.
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
    """Stop this robot now and let nothing move it until the stop is lifted. Right for every operator, at any time.

    Attributes:
        reason: For the holder and the record.
        user: Who wants it, for people; empty: the console that asks.
    """

    reason: Line = ""
    user: Mention = ""


class LiftStop(Message, frozen=True):
    """Let the robot move again.

    Attributes:
        number: Of the stop that is meant: one that was not seen is not lifted.
        user: Who wants it, for people; empty: the console that asks.
    """

    number: Count
    user: Mention = ""


class AskStop(Message, frozen=True):
    """Is this robot stopped?"""


class Stopper(Message, frozen=True):
    """Somebody who stopped a robot.

    Attributes:
        by: Who, for people; without a name the address of the console.
        console: Address of the console it was done by: whom to ask before the stop is lifted. Empty: not known.
    """

    by: Mention
    console: Mention = ""


class StopState(Message, frozen=True):
    """Answer to all three; also published as an event whenever it changes.

    Attributes:
        rc: The robot.
        is_stopped: True: drives and jumps are refused.
        number: Of the last order to stop; grows with each, also if the robot was stopped already.
        by: Who stopped it first, or lifted the last stop.
        reason: As given.
        at_s: Mission time of the stop, or of its end.
        is_confirmed: False if the packet that stops the wheels could not be handed to the radio: nothing new moves
            the robot, and what moves it now ends by itself within ``COMMAND_TIMEOUT_S``.
        console: Address of the console of whom ``by`` names.
        also: Who else stopped it since it moved last.
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
    """A packet on the air: published under the world's address as a command, acknowledged by nobody.

    Attributes:
        radio: Radio that sent it.
        network_id: Robot it is for.
        payload: Bytes of the robot's protocol.
        arc: For the audit: who held robot and radio.
        epoch: For the audit: the robot's epoch under which the payload was made.
        number: Of the packet among those of its radio since it was opened.
        air_time_s: How long its bits take.
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
    """What is the world made of?"""


class WorldModel(Message, frozen=True):
    """Answer to ``AskWorld``: enough to draw the same pictures elsewhere, and to receive them.

    Attributes:
        mjcf: The compiled world's XML.
        robots: Robot name → network id.
        seed: Of everything random in the world.
        air: Between robots and base.
        antenna_m: Where the base's antenna stands: x, y, z.
    """

    mjcf: Document
    robots: Annotated[dict[Mention, Count], MANY]
    seed: Number = 0
    air: AirDescription = AirDescription()
    antenna_m: tuple[Meters, Meters, Meters] = (0.0, 0.0, 1.0)


class AskPose(Message, frozen=True):
    """Where is this body? Asked of the simulated world or of a camera above the room; robots themselves cannot tell."""

    body: Mention


class Pose(Message, frozen=True):
    """Answer to ``AskPose``: metres and radians in the room's frame, origin in a corner of the floor."""

    body: Mention
    at_s: Instant
    x_m: Meters
    y_m: Meters
    heading_rad: Radians


class WorldState(Message, frozen=True):
    """Published by the world once a frame as telemetry.

    Attributes:
        frame: Number of the frame.
        at_s: Mission time it shows.
        state: float64 vector, little endian; meaning is the model's alone.
        transmitting: Robot → video frequency its transmitter is on at.
        on_since: Robot that transmits → first frame in which it did on this frequency.
        motors: Robot that transmits → how fast its wheels turn, 0 to 1 of their limit; one that is missing stands.
    """

    frame: Count
    at_s: Instant
    state: StateVector
    transmitting: Annotated[dict[Mention, Mention], MANY]
    on_since: Annotated[dict[Mention, Count], MANY] = {}
    motors: Annotated[dict[Mention, Share], MANY] = {}


class ClockTick(Message, frozen=True):
    """Published by the world once a frame: the mission's time, for hosts that do not share a monotonic clock."""

    frame: Count
    at_s: Instant
    rate: Rate


# ---------------------------------------------------------------------- refusals
class SwappedOut(Refusal):
    """The ARC holds nothing now; facts: ``reason``, ``by``, ``expected_start_s``."""

    code = "arc.swapped_out"
    remedy = "Wait until it is granted again; 'scout-backbone why' tells when that will be."


class NotMySet(Refusal):
    """The order to open names RCs this ARC never asked for."""

    code = "arc.not_my_set"
    remedy = "Connect the RCs of one of the alternatives in the ARC's request."


class NoSuchAction(Refusal):
    """This kind of ARC has no RC that could do it."""

    code = "arc.no_such_action"
    remedy = "Claim a kind of ARC that has the RC for it (see docs/reference/arcs.md)."


class NotYours(Refusal):
    """Only the ARC's decision process may command it."""

    code = "arc.not_yours"
    remedy = "Claim an ARC of your own."


class NotFromYou(Refusal):
    """Only the RC manager gives and takes RCs; only who holds one commands it. Nothing changed."""

    code = "rc.not_from_you"
    remedy = "Claim an ARC and command through it; the RC manager connects its RCs when its turn comes."


class NeedsRestart(Refusal):
    """The parameter exists, but what runs cannot take it over. Nothing changed."""

    code = "rc.needs_restart"
    remedy = "Change it in the mission file; it counts from the component's next start on."


class ImpossibleUse(Refusal):
    """An RC cannot be held like that."""

    code = "rc.impossible_use"
    remedy = "Connect with the next epoch, a lease of at most an hour, and periods that are finite and above 0."


class EmergencyStopped(Refusal):
    """An operator stopped the robot; nothing moved.

    Facts: ``rc``, ``number``, ``is_stopped``, ``by``, ``reason``, ``since_s``.
    """

    code = "scout.emergency_stop"
    remedy = "See that the robot may move, then lift the stop at a console; the grant is not lost meanwhile."


class GivenBeforeStop(EmergencyStopped):
    """The command was given without knowing of the robot's last stop, which was lifted since; facts as there."""

    code = "scout.given_before_stop"
    remedy = "Give the command anew, now that you know of the stop: let go of the control and press it again."


class OtherStop(Refusal):
    """The stop in force is not the one that was to be lifted; facts: ``number``, ``by``. Nothing changed."""

    code = "scout.other_stop"
    remedy = "Look who stopped the robot since, and lift that stop if it may move."


class NoTurnSoon(Refusal):
    """The ARC's stream on the radio is too slow for what must be sent soon; nothing was sent; fact: ``wait_s``."""

    code = "radio.no_turn_soon"
    remedy = "Claim with a shorter period, or with a further usage for this kind of command."


class HardwareFault(Refusal):
    """The hardware did not do it; the RC reports itself down."""

    code = "rc.hardware"
    remedy = "Check cable, power and driver of the resource."


DEFAULT_DRIVE_USAGE = Usage(period_s=0.05, packet_time_s=0.002, kind="drive")
"""Chosen: 20 commands a second follow a hand on a stick; 2 ms is 24 bytes at 115.2 kbit/s."""

COMMAND_TIMEOUT_S = 0.5  # chosen: longer than a keyboard's repeat delay is short; a robot stops within a body length
