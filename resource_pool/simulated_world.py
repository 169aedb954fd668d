"""The simulated world as hardware: radio packets go in, replies and states of all bodies come out.

The world steps physics at the mission's pace and never skips a step. It catches up after a short delay, but not after a
longer pause: then the world's time stays behind. While it caught up, robots would receive no packet and would stop by
themselves. Once a frame the world publishes its state, from which other processes draw pictures. It also saves where
the bodies are, so that a restart leaves the robots where they were.
"""

from __future__ import annotations

from dataclasses import replace

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.errors import Refusal, complaint
from backbone.exchange_course import UNPROVED
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.wire import Envelope, Message
from resource_pool.drivers.world_messages import AskWorld, RadioPacket, ReplyOnAir, WorldModel, WorldState
from resource_pool.floor_plans import plan_of
from resource_pool.localization import AskFloorPlan, AskHome, AskPose, Pose
from resource_pool.world_file import WorldFile
from scout_model.air import antenna_m, distance_m
from scout_model.description import WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.errors import InvalidWorld, UnknownBody, UnstableBody
from scout_model.radio_air import RadioAir, Sent
from scout_model.radio_link import packet_bits
from scout_model.robot_trial import require_robot
from scout_model.world import World

AWAY_S = 0.1  # chosen: three frames; together with the usual packet interval well below a robot's time-out
SAVED_EACH = 3  # chosen: frames; a robot that drives on while no world runs is wrong by more


class WorldParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The description of the world."""

    world: WorldDescription


class NoSuchBody(Refusal):
    """The world has no body of this name."""

    code = "world.unknown_body"
    remedy = "Use the name of a scout, target or piece of furniture of the mission file."


class SimulatedWorld(Component[WorldParameters]):
    """Simulates robots and room for the simulated drivers, and audits the packets on the air."""

    parameters_type = WorldParameters
    shares_process = False
    given_elsewhere = frozenset({"world"})
    accepts = AskWorld | AskPose | AskHome | AskFloorPlan

    @classmethod
    def driver_options(cls, named: str = "") -> None:
        """Return None, unless the named class of a body is refused."""
        if named:
            try:
                require_robot(named)
            except InvalidWorld as error:
                raise NoSuchBody(str(error.args[0])) from error
            except UNPROVED as error:
                raise NoSuchBody(f"{named} fails with its body: {complaint(error)}") from error

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        described = self.parameters.world
        self._world = World(described)
        self._file = WorldFile(launch.run_directory, self.name)
        if (memory := self._file.read()) is not None:
            self._world.resume(memory)
        self._antenna_m = antenna_m(described.air, described.width_m, described.depth_m)
        self._air = RadioAir(described.seed, described.air)
        self._replies = RadioAir(described.seed, described.air, "reply to ")
        self._robots = {scout.network_id: scout.name for scout in described.robots}
        self._on_since: dict[str, tuple[str, int]] = {}
        self._epochs: dict[int, int] = {}
        self._stops: dict[int, tuple[int, int]] = {}
        self._packets = self._stale = self._overtaken = self._late_frames = 0
        self._jammed_frames = 0
        self._away_s = 0.0

    async def connect(self) -> None:
        """Subscribe to the packets on the air."""
        self.bus.subscribe(self.address, Conversation.COMMAND, RadioPacket, self._hear)

    async def serve(self) -> None:
        """Step one frame after the other, each at its time, and publish the state."""
        first_s = self.clock.now_s()
        frame = 0
        while True:
            frame += 1
            due_s = first_s + frame / FRAMES_PER_S
            late_s = self.clock.now_s() - due_s
            self._late_frames += late_s > 1.0 / FRAMES_PER_S
            if late_s > AWAY_S:
                first_s, due_s = first_s + late_s, due_s + late_s
                self._away_s += late_s
            await self.clock.sleep_until_s(due_s)
            for packet in self._air.arrived(due_s):
                self._world.hear(packet.network_id, packet.payload)
                if packet.asks:
                    self._reply(packet, due_s)
            self._step()
            self._publish(frame, due_s)
            for reply in self._replies.arrived(due_s):
                on_air = ReplyOnAir(reply.radio, reply.network_id, reply.payload, reply.number)
                self.bus.publish(address(Subsystem.RESOURCE_POOL, reply.radio), Conversation.COMMAND, on_air)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``AskWorld`` and the questions to localizers."""
        match asked.body:
            case AskWorld():
                robots = {scout.name: scout.network_id for scout in self.parameters.world.robots}
                described = self.parameters.world
                return WorldModel(self._world.mjcf, robots, described.seed, described.air, self._antenna_m)
            case AskPose(body=body):
                try:
                    x_m, y_m, heading_rad = self._world.pose(body)
                except UnknownBody as error:
                    raise NoSuchBody(str(error)) from error
                return Pose(body, self.clock.now_s(), x_m, y_m, heading_rad)
            case AskHome(body=body):
                for robot in self.parameters.world.robots:
                    if robot.name == body:
                        return Pose(body, self.clock.now_s(), robot.x_m, robot.y_m, robot.heading_rad)
                raise NoSuchBody(f"no robot named {body!r}")
            case AskFloorPlan():
                return plan_of(self.parameters.world)
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Count packets and violations: packets of a stale epoch, packets from before a stop, jammed frames."""
        lost, delivered = self._air.lost, self._air.delivered
        return {
            "packets": self._packets,
            "packets_lost": sum(lost.values()),
            "packets_for_no_robot": self._air.for_no_robot,
            "replies_delivered": sum(self._replies.delivered.values()),
            "replies_lost": sum(self._replies.lost.values()),
            **{f"packets_lost_{name}": lost.get(network_id, 0) for network_id, name in self._robots.items()},
            **{f"packets_delivered_{name}": delivered.get(network_id, 0) for network_id, name in self._robots.items()},
            "stale_packets": self._stale,
            "overtaken_packets": self._overtaken,
            "jammed_frames": self._jammed_frames,
            "late_frames": self._late_frames,
            "away_s": self._away_s,
            "frames": self._world.frame,
        }

    def _step(self) -> None:
        try:
            self._world.step_frame()
        except UnstableBody:
            self._file.forget()  # the next process begins anew
            raise
        if self._world.frame % (FRAMES_PER_S if self._world.stands else SAVED_EACH) == 0:
            self._file.write(self._world.memory())

    def _hear(self, envelope: Envelope[RadioPacket]) -> None:
        packet = envelope.body
        self._packets += 1
        if packet.epoch < self._epochs.get(packet.network_id, 0):
            self._stale += 1
            self.story.note(packet.arc, f"sent robot {packet.network_id} a packet of the past epoch {packet.epoch}")
        self._epochs[packet.network_id] = max(packet.epoch, self._epochs.get(packet.network_id, 0))
        self._audit_stops(packet)
        sent = Sent(
            packet.radio,
            packet.number,
            packet.network_id,
            packet.payload,
            self.clock.now_s(),
            packet.air_time_s,
            packet.asks,
        )
        self._air.send(sent, self._away_m(packet.network_id))

    def _reply(self, asked: Sent, now_s: float) -> None:
        """Send the robot's reply, if it has one, at the bit rate of the packet that asked."""
        payload = self._world.reply(asked.network_id)
        if payload:
            air_time_s = asked.air_time_s * packet_bits(payload) / packet_bits(asked.payload)
            reply = replace(asked, payload=payload, begun_s=now_s, air_time_s=air_time_s)
            self._replies.send(reply, self._away_m(asked.network_id))

    def _away_m(self, network_id: int) -> float | None:
        robot = self._robots.get(network_id)
        return None if robot is None else distance_m(self._world.position_m(robot), self._antenna_m)

    def _audit_stops(self, packet: RadioPacket) -> None:
        last, now = self._stops.get(packet.network_id, (0, 0)), (packet.epoch, packet.robot_stop)
        if now < last and packet.epoch == last[0]:
            self._overtaken += 1
            self.story.note(packet.arc, f"sent robot {packet.network_id} a packet from before its stop {last[1]}")
        self._stops[packet.network_id] = max(now, last)

    def _publish(self, frame: int, at_s: float) -> None:
        transmitting = self._world.transmitting()
        if len(set(transmitting.values())) < len(transmitting):
            self._jammed_frames += 1
        self._on_since = {
            robot: since if (since := self._on_since.get(robot, ("", 0)))[0] == frequency else (frequency, frame)
            for robot, frequency in transmitting.items()
        }
        on_since = {robot: since for robot, (_, since) in self._on_since.items()}
        motors = {robot: motors for robot in transmitting if (motors := round(self._world.motors(robot), 2))}
        state = WorldState(frame, at_s, self._world.state().tobytes(), transmitting, on_since, motors)
        self.bus.publish(self.address, Conversation.BODIES, state)
