"""The creator of a machine that is offered to a mission elsewhere: its process, its folder, its types."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from backbone import run_files
from backbone.addresses import COMPONENT_DATABASE, LAUNCHER, NAMESERVER
from backbone.authentication import SECRET_NAME, keep_secret
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import Absence, AskState, ComponentState, NameTaken
from backbone.component_database.messages import ComponentType, ListTypes, Types, UnknownType
from backbone.creator.messages import TYPE, ProcessFell, ProcessState, creator_name
from backbone.creator.preload import preloaded_modules
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.zygote import Zygote
from backbone.errors import LinkError
from backbone.incarnation import Incarnation
from backbone.kept_file import kept_files, put_back
from backbone.launcher.core_launches import CORE_POLICY
from backbone.launcher.folder_watch import wait_removed
from backbone.launcher.mission_connection import REPLY_TIME_S
from backbone.launcher.mission_recorder import MissionRecorder
from backbone.nameserver.messages import Resolve, Resolved, UnknownName

log = logging.getLogger(__name__)

READY_WITHIN_S = 20.0  # chosen: as for the creators that a launcher starts
PREDECESSOR_ENDS_S = 5.0  # chosen: a killed offer's creator ends within 3 s; seconds of the machine
ASK_AGAIN_S = 0.2  # chosen: no person sees the difference


@dataclass
class LeftFiles:
    """What the components of this machine kept before a cut, for their next processes in the same run of the mission.

    Attributes:
        run: The launcher of that run; None: none is known.
        files: See ``kept_files``.
    """

    run: Incarnation | None = None
    files: Mapping[Path, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Offered:
    """The offered machine, and the mission that may use it.

    Attributes:
        endpoint: Endpoint of the mission's hub.
        host: Name of this machine in the mission.
        secret: Secret of the mission; empty: the hub requires none.
        record: File for the messages of this machine; None: its processes send no copies.
    """

    mission: str
    endpoint: str
    host: str
    tags: tuple[str, ...] = ()
    secret: str = ""
    record: Path | None = None


def prepared_folder(offered: Offered) -> Path:
    """Return the folder of the mission's files on this machine, with the secret in it."""
    directory = run_files.prepare(f"{offered.mission}-{offered.host}")
    if offered.secret:
        keep_secret(directory, offered.secret)
    return directory


def recorder_of_host(offered: Offered, clock: Clock) -> MissionRecorder | None:
    """Return the recorder of this machine; None: nothing is to be recorded here."""
    if offered.record is None:
        return None
    directory = prepared_folder(offered)
    options = ["--connect", offered.endpoint, "--host-folder", str(directory), "--host-only"]
    options += ["--secret-file", str(directory / SECRET_NAME)] if offered.secret else []
    return MissionRecorder(offered.mission, offered.record, clock, options, name=f"recorder of {offered.host}")


class KeptCreator:
    """The creator of this machine, with a zygote and a folder of its own; the mission's secret is in the folder.

    Args:
        left: Files of an earlier creator of this machine; at the end, those of this one.

    Attributes:
        on_fell: Called when the creator has ended unexpectedly.
    """

    def __init__(self, launch: Launch, offered: Offered, left: LeftFiles) -> None:
        self.on_fell: Callable[[ProcessFell], None] = lambda _fell: None
        self.on_changed: Callable[[], None] = lambda: None
        self._launch, self._offered, self._left = launch, offered, left
        self._keeper: ProcessKeeper | None = None

    async def start(self, bus: Bus, clock: Clock) -> None:
        """Start the creator and return when it is ready.

        Raises:
            LinkError: The mission's nameserver or component database did not answer.
            StartFailed: The creator did not become ready; the end of its log is in the detail.
            NameTaken: The mission already has a creator of this host.
        """
        await _wait_free(bus, clock, creator_name(self._launch.host))
        answered = await bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=REPLY_TIME_S)
        types = [counted.component_type for counted in answered.types]
        run = await run_of(bus)
        self._directory = directory = prepared_folder(self._offered)
        if run is not None and self._left.run == run:
            put_back(directory, self._left.files)
        self._left.run = run
        self._zygote = await Zygote.spawn_fresh(run_directory=str(directory))
        self._keeper = ProcessKeeper(self._zygote, clock)
        self._keeper.on_fell = self.on_fell
        self._keeper.on_changed = self.on_changed
        self._keeper.use(bus)
        await self._keeper.start(self._creator_launch(types, directory), CORE_POLICY, READY_WITHIN_S)

    def processes(self) -> list[ProcessState]:
        """Return the creator's process."""
        return self._keeper.processes() if self._keeper is not None else []

    def absences(self) -> list[Absence]:
        """Return the creator as absent while it does not run or respond."""
        return self._keeper.absences() if self._keeper is not None else []

    async def wait_folder_removed(self, clock: Clock) -> None:
        """Return when the folder of the started creator is no longer there."""
        await wait_removed(self._directory, clock)

    async def close(self) -> None:
        """End the creator and all its components. Idempotent."""
        keeper, self._keeper = self._keeper, None
        if keeper is not None:
            await keeper.close()
            self._left.files = kept_files(self._directory)
            await self._zygote.close()

    def _creator_launch(self, types: list[ComponentType], directory: Path) -> Launch:
        return msgspec.structs.replace(
            self._launch,
            name=creator_name(self._launch.host),
            type=TYPE,
            class_path=_creator_class(types),
            parameters={
                "tags": list(self._offered.tags),
                "preload": preloaded_modules(types),
                "types": [msgspec.to_builtins(one) for one in types],
            },
            requester=self._launch.address,
            run_directory=str(directory),
        )


async def run_of(bus: Bus) -> Incarnation | None:
    """Return the launcher of the mission's run; None: it does not answer, which keeps no machine out."""
    try:
        return (await bus.ask(LAUNCHER, AskState(), ComponentState, within_s=REPLY_TIME_S)).incarnation
    except LinkError as error:
        log.warning("the launcher does not answer, so the files from before a cut are not used: %s", error)
        return None


async def _wait_free(bus: Bus, clock: Clock, name: str) -> None:
    """Return when no component has the name, because a creator with its token there would count as ready at once.

    Raises:
        NameTaken: A component still has it after ``PREDECESSOR_ENDS_S``.
    """
    until_s = clock.now_s() + PREDECESSOR_ENDS_S * clock.rate
    while True:
        try:
            there = (await bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)).component
        except UnknownName:
            return
        if clock.now_s() >= until_s:
            raise NameTaken(f"{name} is on {there.host}, pid {there.pid}", name=name, host=there.host, pid=there.pid)
        await clock.sleep_s(ASK_AGAIN_S * clock.rate)


def _creator_class(types: Iterable[ComponentType]) -> str:
    """Return the class of creators in this mission.

    Raises:
        UnknownType: The mission has no type ``creator``.
    """
    found = [component_type.class_path for component_type in types if component_type.name == TYPE]
    if not found:
        raise UnknownType(f"the mission has no component type {TYPE!r}")
    return found[0]
