"""Where joints of robots are, from the published state of the simulated world."""

from __future__ import annotations

import mujoco
import numpy as np
from pool_on_local_network import Pool

from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from resource_pool.drivers.world_messages import AskWorld, WorldModel, WorldState
from scout_model.world import STATE

WORLD = address(Subsystem.RESOURCE_POOL, "world")


async def joints(pool: Pool, *names: str) -> list[float]:
    """Return the positions of these joints of one degree of freedom, named ``robot/joint``."""
    ear = pool.voice_of("ui_console/joints")
    known = await ear.ask(WORLD, AskWorld(), WorldModel, within_s=5)
    states: list[bytes] = []
    hearing = ear.subscribe(WORLD, Conversation.BODIES, WorldState, lambda heard: states.append(heard.body.state))
    await pool.clock.sleep_s(0.1)
    hearing.close()
    model = mujoco.MjModel.from_xml_string(known.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, np.frombuffer(states[-1]), STATE)
    return [float(data.joint(name).qpos[0]) for name in names]
