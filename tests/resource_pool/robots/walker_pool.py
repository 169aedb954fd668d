"""A walker under its ARC, on a radio that it shares with a Scout, in the simulated world; its trunk is watched."""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.bus.interface import Bus
from backbone.component.component import Component
from backbone.dependency_database.messages import Resource
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.scheduling.requests import PathNode, Usage
from backbone.wire import Envelope
from resource_pool.arc_client import ArcClient
from resource_pool.drivers.world_messages import AskWorld, WorldModel, WorldState
from resource_pool.robots.walker import link
from resource_pool.robots.walker.arcs import WalkerCaptureArc, WalkerDriveArc
from resource_pool.robots.walker.rc import WalkerRc
from scout_model.description import RobotPlace, WorldDescription
from scout_model.world import STATE

NETWORK_ID = 5
ROOM = WorldDescription(
    9.0,
    6.0,
    robots=[
        RobotPlace("scout1", 1, 2.0, 1.0, 0.0),
        RobotPlace("walker1", NETWORK_ID, 2.0, 3.0, 0.0, WalkerRc.body_class),
    ],
)
HARDWARE = [Resource("walker1", "walker", parameters={"network_id": NETWORK_ID}, links={"command_radio": ["radio"]})]
DRIVES = Usage(0.05, 0.003, kind="drive")
WORLD = address(Subsystem.RESOURCE_POOL, "world")
FALLEN_RAD = math.radians(30.0)
OPERATOR = "ui_console/console-1"
STANDS_S = 1.0  # chosen: the trot's last steps, and the time in which the board puts the legs down


@dataclass
class Trunk:
    """Where the walker's trunk is, how far it has turned, and how far it was tilted at worst."""

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0
    turned_rad: float = 0.0
    tilt_rad: float = 0.0

    @property
    def has_fallen(self) -> bool:
        return self.tilt_rad > FALLEN_RAD

    def see(self, data: mujoco.MjData) -> None:
        rotation = data.body("walker1/body").xmat
        self.x_m, self.y_m = (float(part) for part in data.body("walker1/body").xpos[:2])
        heading_rad = math.atan2(rotation[3], rotation[0])
        self.turned_rad += math.remainder(heading_rad - self.heading_rad, math.tau)
        self.heading_rad = heading_rad
        self.tilt_rad = max(self.tilt_rad, math.acos(min(1.0, rotation[8])))


async def watch_trunk(bus: Bus) -> Trunk:
    """Return the trunk, which follows each frame of the world from now on."""
    known = await bus.ask(WORLD, AskWorld(), WorldModel, within_s=5)
    model = mujoco.MjModel.from_xml_string(known.mjcf)
    data, trunk = mujoco.MjData(model), Trunk()

    def see(heard: Envelope[WorldState]) -> None:
        mujoco.mj_setState(model, data, np.frombuffer(heard.body.state), STATE)
        mujoco.mj_kinematics(model, data)
        trunk.see(data)

    bus.subscribe(WORLD, Conversation.BODIES, WorldState, see)
    return trunk


def walker_pool(
    mission: Any, rcs: list[str], world: WorldDescription = ROOM, **other_classes: type[Component[Any]]
) -> AbstractAsyncContextManager[Pool]:
    return a_pool(
        mission,
        rcs,
        world=world,
        hardware=HARDWARE,
        rc_classes={"walker": WalkerRc} | other_classes,
        arc_classes={"walker_drive": WalkerDriveArc, "walker_capture": WalkerCaptureArc},
    )


def play(
    mission: Any,
    scene: Callable[[Pool, ArcClient, Trunk], Coroutine[Any, Any, None]],
    world: WorldDescription = ROOM,
    **other_classes: type[Component[Any]],
) -> None:
    """Let the scene run with a walker that stands and is granted for driving; afterwards it has not fallen."""

    async def main() -> None:
        async with walker_pool(mission, ["walker1", "scout1", "radio"], world, **other_classes) as pool:
            trunk = await watch_trunk(pool.ear)
            arc = await claim(pool, "patrol", "walker1")
            granted = await arc.wait_granted()
            assert granted.robot == "walker1"
            await scene(pool, arc, trunk)
            assert not trunk.has_fallen, math.degrees(trunk.tilt_rad)

    run_virtual(main())


async def claim(pool: Pool, owner: str, robot: str, **more: Any) -> ArcClient:
    """Start an ARC of this owner for the robot's driving."""
    kind = "walker_drive" if robot == "walker1" else "drive"
    return await pool.arc(await pool.owner(owner), kind, robot, usage=DRIVES, **more)


async def move_for(pool: Pool, arc: ArcClient, seconds: float, *speeds: float) -> None:
    """Command these speeds ten times a second."""
    for _ in range(round(seconds / 0.1)):
        await arc.move(*speeds)
        await pool.clock.sleep_s(0.1)


async def take_over(pool: Pool, person: str) -> ArcClient:
    """Return the walker's ARC of a person, granted past every behavior."""
    arc = await claim(pool, person, "walker1", path=[PathNode(person, 100)], console=True, minimum_runtime_s=0.1)
    await arc.wait_granted()
    return arc


def sent(pool: Pool) -> list[link.Packet]:
    """Return what went on the air for the walker."""
    return [link.decode(heard.payload) for heard in pool.radio_driver.heard_by(NETWORK_ID)]


def steps(pool: Pool) -> float:
    """Return how often its motion control has stepped."""
    return float(pool.running["walker1"].statistics()["steps"])


async def assert_stands(pool: Pool, trunk: Trunk) -> None:
    """Fail unless the walker stands by now, and its motion control rests."""
    await pool.clock.sleep_s(STANDS_S)
    stood, stepped = (trunk.x_m, trunk.y_m), steps(pool)
    await pool.clock.sleep_s(1.0)
    assert (trunk.x_m, trunk.y_m) == pytest.approx(stood, abs=2e-3)
    assert steps(pool) == stepped
