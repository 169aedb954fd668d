"""Messages between the simulated world and the drivers of simulated hardware, and what the world publishes."""

from __future__ import annotations

from typing import Annotated

from backbone.ranges import (
    MANY,
    Count,
    Document,
    Duration,
    Epoch,
    Instant,
    Mention,
    Meters,
    Name,
    Number,
    Payload,
    Share,
    StateVector,
)
from backbone.wire import Message
from scout_model.description import AirDescription

FLOAT64_BYTES = 8


class RadioPacket(Message, frozen=True, tag="RadioPacket/2"):
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
        asks: True: the packet asks the robot for a reply.
    """

    radio: Name
    network_id: Count
    payload: Payload
    arc: Mention = ""
    epoch: Epoch = 0
    number: Count = 0
    air_time_s: Duration = 0.0
    robot_stop: Count = 0
    asks: bool = False


class ReplyOnAir(Message, frozen=True):
    """A robot's reply on the air: published under the radio's address as a command when it has arrived at the base.

    Attributes:
        radio: The radio that asked.
        network_id: Network id of the robot.
        payload: Bytes of the robot's protocol.
        number: Number of the packet that asked.
    """

    radio: Name
    network_id: Count
    payload: Payload
    number: Count


class AskWorld(Message, frozen=True):
    """Ask for the model of the world."""


class WorldModel(Message, frozen=True):
    """Answer to ``AskWorld``: everything that another process needs to render the same pictures.

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


class WorldState(Message, frozen=True):
    """State of the world, published once a frame.

    Attributes:
        frame: Number of the frame.
        at_s: Mission time of the state.
        state: float64 vector, little endian, to be read by ``Camera.show`` of the same model.
        transmitting: Robot → video frequency of its transmitter, if it is on.
        on_since: Robot that transmits → first frame on this frequency.
        motors: Robot that transmits → speed of its wheels as a share of their limit, 0 to 1; a robot without an entry
            stands still.
    """

    frame: Count
    at_s: Instant
    state: StateVector
    transmitting: Annotated[dict[Mention, Mention], MANY]
    on_since: Annotated[dict[Mention, Count], MANY] = {}
    motors: Annotated[dict[Mention, Share], MANY] = {}

    def __post_init__(self) -> None:
        if len(self.state) % FLOAT64_BYTES:  # the decoder refuses it as malformed
            raise ValueError(f"{len(self.state)} bytes are no vector of float64")
