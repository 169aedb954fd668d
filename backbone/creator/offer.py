"""Offer this machine to a mission elsewhere: run its creator here until told to stop.

The creator and all it starts are clients of the mission's hub. Where the hub is lost for good, or this
process ends, whatever runs here ends too.
"""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Iterable, Sequence

from backbone import run_files
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component_database.messages import ADDRESS as COMPONENT_DATABASE
from backbone.component_database.messages import ComponentType, ListTypes, Types, UnknownType
from backbone.creator.messages import TYPE, ProcessFell, RestartPolicy, creator_name
from backbone.creator.preload import arc_modules
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.zygote import Zygote
from backbone.naming import Subsystem, legal
from backbone.visit import clock_elsewhere

READY_WITHIN_S = 20.0  # chosen: as for the creators a launcher starts
REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this


async def offer(mission: str, endpoint: str, host: str, tags: Sequence[str]) -> ProcessFell | None:
    """Run the mission's creator of this host until SIGTERM or SIGINT; return how it fell, if it was given up.

    Raises:
        HubUnreachable: Nobody listens at the endpoint.
        StartFailed: The creator did not become ready; the end of its log is in the detail.
        NameTaken: The mission has a creator of this host.
    """
    source = f"ui_console/offer-{os.getpid()}"
    clock = await clock_elsewhere(mission, endpoint, source)
    bus = await ZenohBus.open_when_up(mission, source, clock, client_config(endpoint))
    directory = run_files.run_directory(f"{mission}-{legal(host)}")
    zygote = await Zygote.spawn_fresh(run_directory=str(directory))
    keeper = ProcessKeeper(zygote, clock)
    ended: asyncio.Future[ProcessFell | None] = asyncio.get_running_loop().create_future()

    def end(fell: ProcessFell | None = None) -> None:
        if not ended.done() and (fell is None or fell.restart_in_s < 0):
            ended.set_result(fell)

    keeper.on_fell = end
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, end)
    try:
        keeper.use(bus)
        answered = await bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=REPLY_TIME_S)
        types = [counted.component_type for counted in answered.types]
        launch = Launch(
            mission=mission,
            subsystem=Subsystem.BACKBONE,
            name=creator_name(host),
            type=TYPE,
            class_path=_creator_class(types),
            host=host,
            endpoint=endpoint,
            clock_origin_monotonic_s=clock.origin_monotonic_s,
            clock_rate=clock.rate,
            parameters={"tags": list(tags), "preload": arc_modules(types)},
            requester=source,
            run_directory=str(directory),
        )
        await keeper.start(launch, RestartPolicy(), READY_WITHIN_S)
        return await ended
    finally:
        await keeper.close()
        await bus.close()
        await zygote.close()


def _creator_class(types: Iterable[ComponentType]) -> str:
    """Return the class of creators in this mission.

    Raises:
        UnknownType: The mission has no type ``creator``.
    """
    found = [component_type.class_path for component_type in types if component_type.name == TYPE]
    if not found:
        raise UnknownType(f"the mission has no component type {TYPE!r}")
    return found[0]
