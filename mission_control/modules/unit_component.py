"""The component that runs one execution unit on the bus: a thin loop around ``ExecutionUnit``; see ``unit_thread``.

* another unit, or any component → this unit: values of its inputs, published under the addresses that its parameters
  name.
* operator → this unit: the exchange of a module (``exchange``).
* this unit → all: the outputs that its parameters name, published under ``output_address`` (conversation ``outputs``).

Only the newest value of a key waits for delivery, so a slow unit never works on old values; skipped values are counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import WrongParameter
from backbone.debug_views import ListViews, LookAt
from backbone.errors import Refusal
from backbone.exchange import SwapModule, UnknownModule
from backbone.keys import Conversation
from backbone.mission.arranged import Arranged, UnitsQuestion
from backbone.module_waits import AskModule, AwaitedInput, ModuleWaits
from backbone.wire import Accepts, Envelope, Message, UnknownMessage
from mission_control.debug_views import DebugViews
from mission_control.modules.arrangement import judged
from mission_control.modules.choice import SourceChoice
from mission_control.modules.execution_unit import ExecutionUnit, Produced
from mission_control.modules.graph import Graph
from mission_control.modules.long_updates import LongUpdates
from mission_control.modules.orders import (
    ModuleOrder,
    UnitParameters,
    WrongModule,
    is_message,
    output_address,
    unsendable,
)
from mission_control.modules.os_threads import ThreadPlace
from mission_control.modules.ports import kinds_of_ports, type_name
from mission_control.modules.unit_deadlines import UnitDeadlines
from mission_control.modules.unit_exchanges import UnitExchanges
from mission_control.modules.unit_schedule import Trigger
from mission_control.modules.unit_thread import LoopPublisher, UnitThread

if TYPE_CHECKING:  # most modules use no pictures and need no NumPy
    import numpy as np
    from numpy.typing import NDArray

_TABLES = ("overwritten", "modules")  # suffixes in the statistics, so that each entry has its own name
REPORT_EVERY_S = 1.0  # chosen: a person reads no faster; seconds of the mission


class UnitComponent(Component[UnitParameters]):
    """Runs the modules of one unit in the component's event loop, or in their own thread beside it."""

    parameters_type = UnitParameters
    shares_process = False
    given_elsewhere: ClassVar[frozenset[str]] = frozenset(UnitParameters.__struct_fields__)
    accepts: ClassVar[Accepts | None] = ListViews | LookAt | SwapModule | AskModule

    @classmethod
    def arrange(cls, question: UnitsQuestion) -> Arranged:
        """Return the connections of a mission file's units, or all faults."""
        return judged(question)

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        given = self.parameters
        self._modules = {one.name: one.load() for one in given.modules}
        members = [one.member(self._modules[one.name]) for one in given.modules]
        taken, made = dict[str, object](), dict[str, object]()
        for member in members:
            module = self._modules[member.name]
            taken |= {key: kinds_of_ports(module.Inputs)[port.name] for key, port in member.keyed_inputs}
            made |= {key: kinds_of_ports(module.Outputs)[port.name] for key, port in member.keyed_outputs}
        into = {key: kind for key, kind in taken.items() if key in given.sources and key not in made}
        self._graph = Graph({self.name: members}, {key: type_name(kind) for key, kind in into.items()})
        self._into = {key: _message_kind(key, kind) for key, kind in into.items()}
        self._published = {key: _message_kind(key, made.get(key)) for key in given.published}
        self._views = DebugViews(LoopPublisher(bus) if given.own_thread else bus, clock)
        for name, module in self._modules.items():
            module.debug = self._fresh_views(name)
        self._unit: ExecutionUnit = self._new_unit()
        self._as_started = msgspec.structs.replace(given, chosen={})
        self._choose()
        self._thread: UnitThread | None = None
        self._place: ThreadPlace | None = None
        fresh, exchanged = self._fresh_views, self._exchanged
        self._exchanges = UnitExchanges(self, self._modules, self._graph, lambda: self._unit, fresh, exchanged)
        self._missed, self._report_again_s = 0, -math.inf
        self._misses_text = ""
        self._deadlines = self._new_deadlines()
        self._updates = LongUpdates(self, lambda: self._unit.computing, self._tell)

    def _new_unit(self) -> ExecutionUnit:
        trigger = Trigger(self.parameters.frequency_hz, self.parameters.on_input)
        return ExecutionUnit(self.name, self._graph, self._modules, trigger, self.clock.now_s())

    def _fresh_views(self, module: str) -> ViewsOfModule:
        self._views.forget(f"{module}-")
        return ViewsOfModule(module, self._views)

    def _new_deadlines(self) -> UnitDeadlines:
        return UnitDeadlines(self, self._into, self._tell)

    async def connect(self) -> None:
        """Start the thread, if the unit has one, and subscribe to the sources."""
        self._unit = self._new_unit()
        qualities = self.parameters.qualities
        for key in self._published.keys() & qualities.keys():
            self.bus.declare_quality(output_address(self.address, key), Conversation.OUTPUTS, qualities[key])
        self._deadlines = self._new_deadlines()
        if self.parameters.own_thread:
            self._thread = UnitThread(self._unit, self.clock, self._publish, self.fail)
            self._place = await self._thread.place(self.parameters.nice, self.parameters.cpus)
            self.report(self._thread_text())
        for key, kind in self._into.items():
            source = self.parameters.sources[key]
            self.bus.subscribe(source.address, source.conversation, kind, self._listener(key), latest=True)

    async def serve(self) -> None:
        """Run the rounds of the frequency; arriving inputs begin their own rounds."""
        self.start_task(self._deadlines.watch(), "deadlines")
        if self._thread is not None:
            if self._place is not None:
                self.start_task(self._updates.watch(), "long updates")
            await self._thread.keep()
        while self._unit.due_s < math.inf:
            await self.clock.sleep_until_s(self._unit.due_s)
            now_s = self.clock.now_s()
            if self._unit.tick(now_s):
                self._run(now_s)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer questions for debug views and modules, and exchange a module."""
        match asked.body:
            case AskModule(module=module):
                return self._module_waits(module)
            case SwapModule() as swap:
                return await self._exchanges.swap(swap)
            case ListViews():
                return self._views.listed()
            case LookAt() as look:
                return self._views.look(look)
            case _:
                raise UnknownMessage(f"{type(asked.body).__name__} is not answered here")

    def _module_waits(self, module: str) -> ModuleWaits:
        waits = self._unit.waits(module)
        if waits is None:
            raise UnknownModule(f"{self.name} has no module {module!r}")
        makers = {key: one.name for one in self._graph.units[self.name] for key, _port in one.keyed_outputs}
        sources = {key: source.address for key, source in self.parameters.sources.items()} | makers
        late, keys = self._deadlines.late, waits.keys.items()
        awaited = [AwaitedInput(key, sources[key], has_come, key in late) for key, has_come in keys]
        now = self._unit.computing
        since_s = now.round_s if now is not None and now.module == module else None
        return ModuleWaits(waits.runs, awaited, waits.needs_all, since_s)

    def parameters_changed(self) -> None:
        """Choose sources; no other parameter can change at run time.

        Raises:
            WrongParameter: Another parameter would change, or there is no such choice.
        """
        if msgspec.structs.replace(self.parameters, chosen={}) != self._as_started:
            raise WrongParameter(
                f"{self.name} runs the modules it was started with",
                remedy="Change the mission file and start it again.",
            )
        self._choose()

    def _exchanged(self, modules: list[ModuleOrder]) -> None:
        self.parameters = msgspec.structs.replace(self.parameters, modules=modules)
        self._as_started = msgspec.structs.replace(self._as_started, modules=modules)

    def _choose(self) -> None:
        choices = {one.parameters.key: one for one in self._modules.values() if isinstance(one, SourceChoice)}
        for key, source in self.parameters.chosen.items():
            known = choices[key].parameters.sources if key in choices else []
            if source not in known:
                told = [f"{one} from {' or '.join(each.parameters.sources)}" for one, each in choices.items()]
                raise WrongParameter(
                    f"{self.name} cannot choose {source} as {key}",
                    remedy=f"Choose {'; '.join(told)}." if told else "Write <choose> in the mission file.",
                )
        for key, choice in choices.items():
            choice.chosen = self.parameters.chosen.get(key, choice.parameters.sources[0])

    def statistics(self) -> dict[str, float]:
        """Return rates, delays and missed rounds of the unit, and the run times of each module."""
        told = self._unit.statistics(self.clock.now_s())
        own = {name: float(getattr(told, name)) for name in told.__struct_fields__ if name not in _TABLES}
        missed = {f"overwritten_{key}": float(count) for key, count in told.overwritten.items()}
        times = {
            f"{module}_{name}": float(getattr(one, name))
            for module, one in told.modules.items()
            for name in one.__struct_fields__
        }
        return {**own, **missed, **times, **self._thread_statistics(), **self._deadlines.statistics()}

    def _thread_statistics(self) -> dict[str, float]:
        place, thread = self._place, self._thread
        if place is None or thread is None:
            return {}
        return {
            "thread_nice": float(place.nice),
            "thread_processors": float(len(place.cpus)),
            "thread_lost": float(thread.lost),
        }

    def _listener(self, key: str) -> Callable[[Envelope[Message]], None]:
        def heard(envelope: Envelope[Message]) -> None:
            self._deadlines.met(key)
            if self._thread is not None:
                self._thread.put(key, envelope.body)
            elif self._unit.put(key, envelope.body):
                self._run(self.clock.now_s())

        return heard

    def _run(self, now_s: float) -> None:
        self._publish(now_s, self._unit.run(now_s))

    def _publish(self, now_s: float, produced: list[Produced]) -> None:
        for key, value in produced:
            if key in self._published:
                assert isinstance(value, Message)  # noqa: S101  its class was checked at the start
                try:
                    self.bus.publish(output_address(self.address, key), Conversation.OUTPUTS, value)
                except (Refusal, TypeError, BufferError) as error:  # a field of another class; memory with gaps
                    raise unsendable(f"{key}, a {type(value).__name__},", key, error) from error
        if now_s >= self._report_again_s:
            self._report_misses(now_s)

    def _report_misses(self, now_s: float) -> None:
        told = self._unit.statistics()
        missed = told.missed + sum(told.overwritten.values())
        if missed > self._missed:
            self._missed, self._report_again_s = missed, now_s + REPORT_EVERY_S
            ticks = [f"{told.missed} rounds missed, the latest {told.most_late_s:.3f} s late"] if told.missed else []
            values = [f"{count} values of {key} came too early" for key, count in told.overwritten.items()]
            self._misses_text = "; ".join([*ticks, *values])
            self._tell()

    def _tell(self) -> None:
        """Report late inputs, a long update, missed rounds, and the place of the thread."""
        texts = self._deadlines.text, self._updates.text, self._misses_text, self._thread_text()
        self.report("; ".join(filter(None, texts)))

    def _thread_text(self) -> str:
        given = self.parameters
        return str(self._place) if self._place is not None and (given.nice or given.cpus) else ""


class ViewsOfModule:
    """The debug views of one module, as views of its unit; see ``module.Debug``."""

    def __init__(self, module: str, views: DebugViews) -> None:
        self._module, self._views = module, views

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Show a picture; the view's name is ``<module>-<view>``."""
        self._views.picture(f"{self._module}-{view}", make)

    def value(self, view: str, value: float | bool | str) -> None:
        """Show a value; the view's name is ``<module>-<view>``."""
        self._views.value(f"{self._module}-{view}", value)


def _message_kind(key: str, kind: object) -> type[Message]:
    """Return the class of the values of a key that crosses the bus.

    Raises:
        WrongModule: The class is not a message.
    """
    if is_message(kind):
        return kind
    made = "no module produces it" if kind is None else f"{type_name(kind)} is no message"
    raise WrongModule(
        f"{key} cannot go to another unit: {made}",
        remedy="Derive its class from backbone.wire:Message, or put both modules into one unit.",
    )
