"""Times of a command from a behavior to its ARC, from there to the robot's RC, and of the answer back.

Prints one JSON line. The floor is one bare zenoh question through the mission's hub, asked by the behavior's own
process between two commands; see ``commanding_behavior.py``.
"""

from __future__ import annotations

import argparse
import asyncio

import uvloop
import zenoh
from measuring import report
from missions import mission_up
from round_trip import serve_bare

from backbone.bus.zenoh_bus import client_config
from backbone.component.messages import AskStatistics, Statistics
from backbone.launcher.mission_connection import connected
from backbone.run_files import find, secret

MISSION = "command-path"
FILE = f"""<mission name="{MISSION}" priority="10">
  <hosts><host name="base" address="127.0.0.1" tags="radio"/></hosts>
  <types><type name="commanding" class="commanding_behavior:CommandingBehavior" subsystem="mission_control"/></types>
  <resources>
    <resource type="command_radio" name="radio" sharable="true" capacity="1.0" driver="simulated" process="hardware"/>
    <resource type="scout" name="scout1" driver="simulated" process="hardware">
      <uses type="command_radio" name="radio"/>
      <parameter name="network_id" value="1"/>
    </resource>
  </resources>
  <world name="world" host="base" seed="1">
    <room width-m="90" depth-m="90"/>
    <robot name="scout1" x-m="45" y-m="45" heading-deg="90"/>
  </world>
  <behaviors>
    <behavior type="commanding" name="commanding" priority="5">
      <arc kind="drive" minimum-runtime-s="600" period-s="0.1"><wish type="scout" name="scout1"/></arc>
    </behavior>
  </behaviors>
</mission>
"""
GRANTED_WITHIN_S = 30.0  # chosen: a mission that is ready grants its first set within a second, on a full machine too
TIMES = ("command_p50_s", "command_p99_s", "bare_p50_s", "bare_p99_s")


async def measure(seconds: float) -> dict[str, float]:
    """Answer bare questions for the given time from the first command on; return the behavior's statistics."""

    async def asked() -> dict[str, float]:
        return (await bus.ask("mission_control/commanding", AskStatistics(), Statistics, within_s=2)).values

    found = find(MISSION)
    with zenoh.open(client_config(found.endpoint, secret(found))) as bare:
        serve_bare(bare)
        async with connected(MISSION, None, "ui_console/bench") as (bus, clock):
            async with asyncio.timeout(GRANTED_WITHIN_S):
                while not (await asked())["commands"]:
                    await clock.sleep_s(0.1)
            await clock.sleep_s(seconds)
            return await asked()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    seconds = parser.parse_args().seconds
    with mission_up(FILE, name=MISSION):
        values = uvloop.run(measure(seconds))
    report(
        "command_path",
        commands=int(values["commands"]),
        **{name[:-1] + "us": round(values[name] * 1e6) for name in TIMES},
        floor="one bare question through the same hub, by the same process",
        ratio=round(values["command_p50_s"] / values["bare_p50_s"], 2),
        aim=2.2,
    )


if __name__ == "__main__":
    main()
