"""The creator: starts, watches, restarts and ends processes on its host, for the placer.

When a creator dies, by any signal, all its components die with it (see ``zygote_process``). So a new creator starts
without components and never competes with its predecessor for names.

Source: S000, "creator"; RAM 2002, "Backbone".
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import msgspec
import psutil

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.heartbeat import read_vitals
from backbone.component.launch import Launch
from backbone.component.messages import Absence, LogLevel
from backbone.component.recurring import CALM_S, Recurring
from backbone.component_database.messages import ComponentType
from backbone.creator.messages import (
    AlreadyHere,
    AskLoad,
    CreatorQuestion,
    EndProcess,
    FixedTypes,
    HostLoad,
    ListProcesses,
    NotThePlacer,
    Processes,
    ProcessFell,
    ReviseSpawn,
    Spawn,
    Spawned,
    SpawnRevised,
    UnlistedType,
)
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.signs_of_life import ReadVitals
from backbone.creator.zygote import Forks, Zygote
from backbone.keys import Conversation
from backbone.naming import MAX_NAME_LENGTH, legal
from backbone.operating_system.memory_folder import disk_of
from backbone.wire import Envelope, Message

LONGEST_CLASS_PATH = 200  # chosen: a person reads no more of a refused class path
LOAD_EACH_S = 1.0  # HostLoad: "once a second", of the machine


class CreatorParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of a creator.

    Attributes:
        tags: Tags of this host, for the placer's choice.
        preload: Modules that its zygote imports at its start, so that components start sooner.
        types: The mission's component types. The creator runs these, except core services, and no others.
    """

    tags: list[str] = []
    preload: list[str] = []
    types: list[ComponentType] = []


class Creator(Component[CreatorParameters]):
    """Runs the placer's components on this host."""

    parameters_type = CreatorParameters
    accepts = CreatorQuestion
    drains_within_s = None
    shares_process = False

    _forked: ClassVar[dict[str, Zygote]] = {}
    """Zygotes that ``before_bus`` forked, by address, until their creators take them over."""

    @classmethod
    def before_bus(cls, launch: Launch) -> None:
        """Fork the zygote, because this process cannot fork once a bus is open."""
        preload = launch.parameters.get("preload", [])
        if isinstance(preload, list):  # the check of the parameters refuses other values
            cls._forked[launch.address] = Zygote.fork_now(preload=[str(module) for module in preload])

    _zygote: Forks
    _keeper: ProcessKeeper

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        zygote: Forks | None = None,
        read_vitals: ReadVitals = read_vitals,
    ) -> None:
        super().__init__(launch, bus, clock)
        self._fixed = (self.parameters.types, self.parameters.preload)
        self._allowed = {(t.name, t.class_path, t.subsystem) for t in self.parameters.types if not t.core}
        self._given = zygote or self._forked.pop(launch.address, None)
        self._read_vitals = read_vitals
        self._load = (0.0, 0.0, 1)
        self._spawned = self._ended = self._fell = 0
        self._silences = Recurring(CALM_S * clock.rate)

    async def connect(self) -> None:
        """Watch liveliness tokens; spawn a zygote if this process could not fork one."""
        self._zygote = self._given or await Zygote.spawn_fresh(preload=self.parameters.preload)
        self._zygote.on_lost = lambda: self.publish_event(
            self.name, "lost its zygote and with it all its components", LogLevel.ALARM
        )
        self._keeper = ProcessKeeper(self._zygote, self.clock, self._read_vitals, self.start_number)
        self._keeper.on_fell = self._component_fell
        self._keeper.on_silent = self._component_silent
        self._keeper.on_changed = self._processes_changed
        self._keeper.on_bug = self.fail
        self._keeper.use(self.bus)
        self._load = self.measure()

    async def serve(self) -> None:
        """Publish the host's load."""
        self._say_if_on_disk()
        while True:
            self._load = self.measure()
            self._publish_load()
            await self.clock.sleep_s(LOAD_EACH_S * self.clock.rate)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``ListProcesses`` and ``AskLoad``, and the placer's ``Spawn``, ``ReviseSpawn`` and ``EndProcess``."""
        question: Message = asked.body
        match question:
            case Spawn():
                self._refuse_strangers(asked)
                return await self._spawn(question)
            case ReviseSpawn() as revised:
                self._refuse_strangers(asked)
                self._keeper.revise(revised)
                self.story.note(revised.name, "starts with other parameters from its next start on")
                return SpawnRevised()
            case EndProcess(name=name, reason=reason, ask_s=ask_s, term_s=term_s):
                self._refuse_strangers(asked)
                ended = await self._keeper.end(name, reason, ask_s, term_s)
                self._ended += 1
                self.story.note(name, f"was ended by {ended.by}: {reason}")
                return ended
            case ListProcesses():
                return Processes(self.launch.host, self.parameters.tags, self._keeper.processes())
            case AskLoad():
                return self._host_load()
        return await super().answer(asked)

    async def drain(self) -> None:
        """End all components, the last started first, then the zygote."""
        await self._keeper.close()
        await self._zygote.close()

    def absences(self) -> list[Absence]:
        """Return the placer's orders whose components do not run or respond."""
        return self._keeper.absences()

    def parameters_changed(self) -> None:
        """Publish new tags to the placer at once.

        Raises:
            FixedTypes: Types or modules differ from those of the launch; nothing is changed.
        """
        if (self.parameters.types, self.parameters.preload) != self._fixed:
            raise FixedTypes(f"{self.name} keeps the types and modules it was launched with")
        self._publish_load()

    def statistics(self) -> dict[str, float]:
        """Return counts since its start."""
        return {
            "components": float(self._count()),
            "spawned": float(self._spawned),
            "ended": float(self._ended),
            "fell": float(self._fell),
        }

    def _refuse_unlisted(self, order: Spawn) -> None:
        """Return if the order is for a type of the mission, under legal names, which lead to no other folder.

        Raises:
            UnlistedType: The mission's types do not contain the class.
            IllegalName: The name of the component or of its process is illegal.
        """
        if (order.type, order.class_path, order.subsystem) not in self._allowed:
            raise UnlistedType(
                f"{order.name[:MAX_NAME_LENGTH]}: {order.subsystem} {order.type[:MAX_NAME_LENGTH]} with class "
                f"{order.class_path[:LONGEST_CLASS_PATH]} is no type of this mission"
            )
        legal(order.name)
        if order.process:
            legal(order.process)

    async def _spawn(self, order: Spawn) -> Spawned:
        self._refuse_unlisted(order)
        self._silences.forget(order.name)
        launch = msgspec.structs.replace(
            self.launch,
            subsystem=order.subsystem,
            name=order.name,
            type=order.type,
            class_path=order.class_path,
            parameters=order.parameters,
            requester=order.requester,
            process=order.process,
            order_id=order.order_id,
        )
        try:
            pid = await self._keeper.start(launch, order.policy, order.ready_within_s, order)
        except AlreadyHere:
            if not self._is_asked_again(order):
                raise
            pid = await self._keeper.wait_ready(order.name, order.ready_within_s)
        self._spawned += 1
        self.story.note(order.name, f"is ready, pid {pid}, ordered by {order.requester or PLACER}")
        return Spawned(launch.address, pid)

    def _is_asked_again(self, order: Spawn) -> bool:
        """Return whether the component runs by the same order; a restarted placer may ask with another id."""
        present = self._keeper.order(order.name)
        return present is not None and msgspec.structs.replace(present, order_id=order.order_id) == order

    def _refuse_strangers(self, asked: Envelope[Message]) -> None:
        if asked.source != PLACER:
            raise NotThePlacer(f"{asked.source} asked {self.address} for {type(asked.body).__name__}")

    def _component_fell(self, fell: ProcessFell) -> None:
        self._fell += 1
        self._silences.forget(fell.name)
        then = f"restarts in {fell.restart_in_s:.2g} s" if fell.restart_in_s >= 0 else "its owner asks for another one"
        self.publish_event(fell.name, f"fell, {fell.how}; {then}", LogLevel.WARNING)
        self.bus.publish(self.address, Conversation.EVENTS, fell)

    def _component_silent(self, name: str, silent_s: float) -> None:
        if not silent_s:
            over_s = self._silences.goes(name, self.clock.now_s())
            self.start_task(self._say_who_responds(over_s), "say who responds again")
        elif self._silences.comes(name):
            self.publish_event(name, f"shows no sign of life for {silent_s:.1f} s", LogLevel.WARNING)
        self._processes_changed()

    async def _say_who_responds(self, over_s: float) -> None:
        await self.clock.sleep_until_s(over_s)
        for name, count in self._silences.over(over_s).items():
            times = f", after {count} silences" if count > 1 else ""
            self.publish_event(name, f"responds again{times}", LogLevel.WARNING)

    def _processes_changed(self) -> None:
        self._publish_load()
        self.changed()

    def _say_if_on_disk(self) -> None:
        if self.launch.run_directory and (disk := disk_of(Path(self.launch.run_directory))):
            danger = f"keeps its files on a disk ({disk}): while that is slow, robots obey late"
            self.publish_event(self.name, f"{danger}; set XDG_RUNTIME_DIR to a folder in memory", LogLevel.NOTICE)

    def measure(self) -> tuple[float, float, int]:
        """Return the busy share of all cores, the used share of memory, and the number of cores."""
        return psutil.cpu_percent() / 100.0, psutil.virtual_memory().percent / 100.0, psutil.cpu_count() or 1

    def _publish_load(self) -> None:
        self.bus.publish(self.address, Conversation.TELEMETRY, self._host_load())

    def _host_load(self) -> HostLoad:
        cpu, memory, cores = self._load
        return HostLoad(self.launch.host, self.parameters.tags, cpu, memory, cores, self._count())

    def _count(self) -> int:
        return len(self._keeper.processes())
