"""Bring a mission up in the papers' order, keep its core services alive, take it down in reverse.

The launcher is a component (``backbone/launcher``), which lists its processes and can be stopped. It starts only the
core services, and asks the placer to start all other components.

Source: RAM 2002, "Backbone": nameserver, component database, placer, creators, static dependency
database, RC manager, then the mission.
"""

from __future__ import annotations

import asyncio
import os
import signal
import time
from pathlib import Path

from backbone import run_files, unexpected_ends
from backbone.addresses import LAUNCHER
from backbone.authentication import secret_of
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component.process import run_with_heartbeat
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.zygote import Zygote
from backbone.errors import BackboneError
from backbone.launcher.core_launches import CORE_POLICY, UpOptions, launcher_launch, service_launch
from backbone.launcher.ending_messages import EndMission, MissionEnding
from backbone.launcher.launcher import Launcher
from backbone.launcher.mission_recorder import MissionRecorder, recorder_of_mission, require_new
from backbone.launcher.other_hosts import endpoint_for_others
from backbone.launcher.outcome import BringUpObserver, Outcome
from backbone.launcher.preconditions import (
    prepare_endpoint,
    refuse_if_up,
    refuse_paths_of_no_message,
    require_files,
    require_process_table,
)
from backbone.mission.model import MissionDescription
from backbone.operating_system.ending_signals import orders_to_end
from backbone.operating_system.heaps import share_heaps

START_TIME_S = 40.0  # chosen: a renderer on a slow machine opens within half of it
ORDER_S = 10.0  # chosen: beside twenty busy processes an answer took seconds; a second order ends the last branch


async def run_mission(description: MissionDescription, options: UpOptions, observer: BringUpObserver) -> Outcome:
    """Bring the mission up, run it, take it down; return when all its processes and files are gone.

    Raises:
        NoProcessTable: The system does not show its processes.
        TooFewFiles: The system lets a process open too few files.
        MissionAlreadyUp: A mission of this name runs on this machine.
        FolderInUse: A mission of this name is coming up or ending on this machine.
        PathNotUtf8: The path of a file or folder of the mission is no UTF-8.
        RunFolderUnusable: The run folder is not writable.
        TraceUnwritable: The trace is not writable, or has content.
        RecorderFailed: The file of the recording exists, or cannot be written.
        BackboneError: The nameserver did not start.
    """
    began_s = time.monotonic()
    require_process_table()
    require_files()
    share_heaps()
    files = [path.absolute() for path in (options.trace, options.record) if path is not None]
    refuse_paths_of_no_message(description.name, description.source, *files)
    refuse_if_up(description.name)
    with run_files.own_folder(description.name) as directory:
        if options.trace is not None:
            run_files.begin_trace(options.trace)
        if options.record is not None:
            require_new(options.record)
        endpoint = prepare_endpoint(description, directory)
        clock = MissionClock(began_s, options.speed)
        own = launcher_launch(description, endpoint, clock, directory)
        observer.comes_up(description.name)
        observer.began("nameserver")
        zygote = await Zygote.spawn_fresh(run_directory=str(directory))
        try:
            return await _with_hub(zygote, own, clock, description, options, observer, began_s)
        finally:
            run_files.unlist(directory)
            await zygote.close()


async def _with_hub(
    zygote: Zygote,
    own: Launch,
    clock: MissionClock,
    description: MissionDescription,
    options: UpOptions,
    observer: BringUpObserver,
    began_s: float,
) -> Outcome:
    keeper = ProcessKeeper(zygote, clock)
    others = endpoint_for_others(description)
    hub = service_launch(own, "nameserver", "nameserver", description, {"listen": [others] if others else []})
    await keeper.start_hub(hub, CORE_POLICY)
    config = client_config(own.endpoint, secret_of(own.run_directory))
    bus = await ZenohBus.open_when_up(own.mission, own.address, clock, config)
    bus.use_host(own.run_directory)
    observer.connected(bus)
    keeper.use(bus)
    await keeper.wait_ready(hub.name, START_TIME_S)
    observer.done("nameserver", time.monotonic() - began_s)
    _write_run_file(own, clock, description.source)
    recorder = (
        recorder_of_mission(description, options.text, options.record, clock, own.run_directory)
        if options.record
        else None
    )
    launcher = Launcher(
        own,
        bus,
        clock,
        keeper=keeper,
        description=description,
        options=options,
        observer=observer,
        began_s=began_s,
        recorder=recorder,
    )
    try:
        await _run(own, clock, launcher, recorder)
    except Exception as bug:
        launcher.outcome.failure = launcher.outcome.failure or bug
        raise
    finally:
        unexpected_ends.keep(Path(own.run_directory), launcher.outcome.unexpected_end)
        launcher.outcome.ended += await keeper.close()
    return launcher.outcome


def _write_run_file(own: Launch, clock: MissionClock, source: str) -> None:
    run_files.write(
        run_files.RunFile(
            mission=own.mission,
            endpoint=own.endpoint,
            launcher_pid=os.getpid(),
            clock_origin_monotonic_s=clock.origin_monotonic_s,
            clock_rate=clock.rate,
            host=own.host,
            source=source,
        )
    )


async def _run(own: Launch, clock: MissionClock, launcher: Launcher, recorder: MissionRecorder | None) -> None:
    """Run the launcher until the mission or a signal ends it; an error becomes the failure of its outcome."""
    loop = asyncio.get_running_loop()
    orders = orders_to_end()
    for number in orders:
        loop.add_signal_handler(number, launcher.end, number.name)
    loop.add_signal_handler(signal.SIGINT, launcher.interrupted)
    try:
        await run_with_heartbeat(own, clock, launcher.run(), lambda: launcher.feedback or str(launcher.state))
    except BackboneError as error:
        launcher.outcome.failure = launcher.outcome.failure or error
    finally:
        await launcher.bus.close()  # if the launcher was not reached
        for number in (signal.SIGINT, *orders):
            loop.remove_signal_handler(number)
        if recorder is not None:
            await recorder.end()


async def end_mission(bus: Bus, *, at_once: bool = False) -> MissionEnding:
    """Order the launcher to take its mission down; return the state of the last branch.

    Raises:
        LinkError: The launcher did not answer.
        Refusal: The launcher is of another release.
    """
    return await bus.ask(LAUNCHER, EndMission(at_once), MissionEnding, within_s=ORDER_S)
