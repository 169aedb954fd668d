"""The exchanges of modules in one running unit: imports the new class, starts the exchange, reports its course."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NoReturn

import msgspec

from backbone.component.component import Component
from backbone.component.log_level import LogLevel
from backbone.errors import Refusal, complaint
from backbone.exchange import ExchangeRunning, SwapModule, Swapped, UnknownModule
from backbone.exchange_answers import ExchangeAnswers
from backbone.exchange_course import UNPROVED, ExchangePhase, ExchangeRules, remark_on_file
from backbone.keys import Conversation
from backbone.naming import did_you_mean
from backbone.placer.messages import ReviseStart
from backbone.placer.revising import revise_start
from backbone.quality import QUALITY
from backbone.reading_anew import HANGS, READ_WITHIN_S, read_anew
from backbone.waiting import in_thread_within, set_within
from mission_control.modules.choice import SourceChoice
from mission_control.modules.exchange import Exchange
from mission_control.modules.exchangeable import graph_with, judge_of, judge_of_sent, kinds_made
from mission_control.modules.execution_unit import ExecutionUnit, WantedExchange
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import UNSEEN, Debug, Module
from mission_control.modules.orders import ModuleOrder, UnitParameters, WrongModule, is_message, load_module_class

HANGS_S = 30.0  # chosen: far longer than any round at work, and the command still waits then; machine seconds
MOST_COUNTED_S = 0.1  # chosen: of the time between two looks, because a process that was paused does not hang
LEAST_WAIT_S = 0.01  # chosen: if a round runs in a thread when the time of its exchange is over, the round ends soon


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A new module, and the module that it should replace."""

    asked: SwapModule
    before: ModuleOrder
    old: Module
    order: ModuleOrder
    new: Module


class UnitExchanges:
    """Exchanges modules of one unit, one at a time.

    Args:
        component: Component that runs the unit; its parameters name the running modules.
        modules: Name → module; kept up to date.
        graph: The unit's graph at its start.
        views: Returns the debug views for the class of a module that produces from now on.
        exchanged: Called after an exchange with the orders of all running modules, which become the component's
            parameters.
    """

    def __init__(
        self,
        component: Component[UnitParameters],
        modules: dict[str, Module],
        graph: Graph,
        unit: Callable[[], ExecutionUnit],
        views: Callable[[str], Debug],
        exchanged: Callable[[list[ModuleOrder]], None],
    ) -> None:
        self._component, self._modules, self._graph, self._unit = component, modules, graph, unit
        self._views, self._exchanged = views, exchanged
        self._kinds: dict[str, object] = {}
        """Key → class of the values; those at the start, because a file that is imported again declares new classes."""
        for one in component.parameters.modules:
            self._kinds |= kinds_made(modules[one.name], one.member(modules[one.name]))
        self._running = ""
        self._answers = ExchangeAnswers()

    async def swap(self, asked: SwapModule) -> Swapped:
        """Exchange the module; return when the new one has passed its trial, or the old one is back.

        Raises:
            UnknownModule: The unit has no such module, or the module is a choice.
            ExchangeRunning: Another exchange of this unit is still running.
            WrongModule: The class cannot be imported or created.
            ValuesChanged: The new file declares classes of values differently.
            GraphRefused: The module has other ports; the error lists all faults.
            UnknownExchange: The request is repeated, and this process did not get it before.
        """
        return await self._answers.answer(asked, lambda: self._swap_one(asked))

    async def _swap_one(self, asked: SwapModule) -> Swapped:
        if asked.module not in self._modules:
            meant = did_you_mean(asked.module, self._modules)
            raise UnknownModule(f"{self._component.name} has no module {asked.module!r}{meant}")
        if isinstance(self._modules[asked.module], SourceChoice):
            remedy = f"Choose another source: 'scout-backbone set {self._component.name} chosen …'."
            raise UnknownModule(f"{asked.module} chooses between sources and cannot be exchanged", remedy=remedy)
        if self._running:
            raise ExchangeRunning(f"{self._component.name} is exchanging {self._running}")
        self._running = asked.module
        try:
            return await self._swap(asked)
        except Refusal as refusal:
            self._tell(asked, f"is not exchanged: {refusal.detail}", LogLevel.WARNING)
            raise
        finally:
            self._running = ""

    async def _swap(self, asked: SwapModule) -> Swapped:
        anew = await read_anew(asked.class_path, load_module_class, WrongModule)  # rounds go on while it imports
        try:
            candidate = await self._candidate(asked, anew.kind)
            wanted, changed = self._wanted(candidate)
        except Refusal:
            anew.undo()
            raise
        by = f" for {asked.user}" if asked.user else ""
        self._tell(asked, f"{asked.class_path} warms beside {candidate.before.class_path}{by}", LogLevel.NOTICE)
        self._unit().exchange(wanted)
        await self._until_over(candidate, wanted.exchange, changed)
        if wanted.exchange.phase is ExchangePhase.RETURNED:
            anew.undo()
            return self._returned(candidate, wanted.exchange)
        return await self._proved(candidate, wanted)

    async def _candidate(self, asked: SwapModule, kind: type[Module]) -> _Candidate:
        [before] = [one for one in self._component.parameters.modules if one.name == asked.module]
        try:
            order, new = await in_thread_within(partial(_made, asked, before, kind), READ_WITHIN_S)
        except TimeoutError:
            told = f"{asked.class_path} is not made within {READ_WITHIN_S:g} s"
            raise WrongModule(told, remedy=HANGS) from None
        return _Candidate(asked, before, self._modules[asked.module], order, new)

    def _wanted(self, candidate: _Candidate) -> tuple[WantedExchange, asyncio.Event]:
        """Return the exchange, and an event that each change of its phase sets."""
        asked, new = candidate.asked, candidate.new
        member = candidate.order.member(new)
        graph = graph_with(self._graph, self._component.name, member)
        changed, loop = asyncio.Event(), asyncio.get_running_loop()
        exchange = Exchange(
            ExchangeRules(asked.prove_s, asked.ready_within_s, asked.silent_s),
            new.is_ready,
            lambda: _unless_closed(loop, changed),
            self._component.clock.now_s(),
        )
        is_declared, is_readable = judge_of(self._kinds, type(new), member), self._judge_of_sent(member)

        def judge(outputs: object) -> None:
            is_declared(outputs)
            if not exchange.is_over:  # what a listener cannot read is a bug afterwards, as without an exchange
                is_readable(outputs)

        return WantedExchange(graph, asked.module, new, exchange, judge), changed

    def _judge_of_sent(self, member: Member) -> Callable[[object], None]:
        """Return a function that raises if a published output cannot be sent; see ``judge_of_sent``."""
        given = self._component.parameters
        qualities = {key: given.qualities.get(key, QUALITY[Conversation.OUTPUTS]) for key in given.published}
        most_bytes = {key: max(one.most_bytes, one.most_bytes_on_host) for key, one in qualities.items()}
        kinds = {key: kind for key, kind in self._kinds.items() if is_message(kind)}
        return judge_of_sent(self._component.address, most_bytes, kinds, member)

    async def _until_over(self, candidate: _Candidate, exchange: Exchange, changed: asyncio.Event) -> None:
        clock, loop = self._component.clock, asyncio.get_running_loop()
        overdue_s = 0.0
        while not exchange.is_over:
            left_s, looked_s = max(LEAST_WAIT_S, (exchange.due_s - clock.now_s()) / clock.rate), loop.time()
            if not await set_within(changed, left_s):
                exchange.pass_time(clock.now_s())
                overdue_s += min(loop.time() - looked_s, MOST_COUNTED_S)
                if overdue_s > HANGS_S and not exchange.is_over:
                    self._end_unit(candidate)
                continue
            changed.clear()
            overdue_s = 0.0
            if exchange.phase is ExchangePhase.PROVING:
                self._let_show(candidate.new, candidate)
                self._tell(candidate.asked, f"{candidate.order.class_path} produces, and has to prove itself")
        self._let_show(candidate.new if exchange.phase is ExchangePhase.PROVED else candidate.old, candidate)

    def _let_show(self, one: Module, candidate: _Candidate) -> None:
        """Give the debug views to this one of the two."""
        for other in (candidate.old, candidate.new):
            if other is not one:
                other.debug = UNSEEN
        if one.debug is UNSEEN:
            one.debug = self._views(candidate.asked.module)

    def _end_unit(self, candidate: _Candidate) -> NoReturn:
        """End the unit, because a round hangs in its thread: no heartbeat is missing, so its creator sees nothing.

        Raises:
            WrongModule: The unit ends.
        """
        old, new = candidate.before.class_path, candidate.order.class_path
        told = f"a round with {new} has not ended for {HANGS_S:g} s, so the unit ends"
        self._component.fail(RuntimeError(told))
        then = remark_on_file(self._component.name, old, new) or "the unit starts again with the old class"
        raise WrongModule(told, remedy=f"Look for a loop or a wait in update; {then}.")

    def _returned(self, candidate: _Candidate, exchange: Exchange) -> Swapped:
        old, new = candidate.before.class_path, candidate.order.class_path
        self._tell(candidate.asked, exchange.outcome(old, new), LogLevel.WARNING)
        return exchange.answer(self._component.clock.now_s(), remark_on_file(self._component.name, old, new))

    async def _proved(self, candidate: _Candidate, wanted: WantedExchange) -> Swapped:
        name, component, exchange = candidate.asked.module, self._component, wanted.exchange
        self._modules[name], self._graph = candidate.new, wanted.graph
        modules = [candidate.order if one.name == name else one for one in component.parameters.modules]
        self._exchanged(modules)
        told = exchange.outcome(candidate.before.class_path, candidate.order.class_path)
        self._tell(candidate.asked, told, LogLevel.NOTICE)
        order = ReviseStart(component.name, msgspec.to_builtins(component.parameters))
        return exchange.answer(component.clock.now_s(), await revise_start(component.bus, component.clock, order))

    def _tell(self, asked: SwapModule, what: str, level: LogLevel = LogLevel.INFO) -> None:
        self._component.publish_event(asked.module, what, level)
        self._component.report(f"{asked.module}: {what}")


def _made(asked: SwapModule, before: ModuleOrder, kind: type[Module]) -> tuple[ModuleOrder, Module]:
    """Return the new module and its order.

    Raises:
        WrongDeclaration: A port of the class cannot be read from its declaration.
        WrongModule: The module refuses its parameters, or cannot be created.
    """
    try:
        order = _order(asked, before, kind)
        return order, order.load()
    except Refusal:
        raise
    except UNPROVED as error:
        raise WrongModule(f"{asked.class_path} cannot be made: {complaint(error)}") from error


def _order(asked: SwapModule, before: ModuleOrder, kind: type[Module]) -> ModuleOrder:
    has = {one.encode_name for one in msgspec.structs.fields(kind.Parameters)}
    kept = {name: value for name, value in before.parameters.items() if name in has}
    ports = kind.ports()
    return ModuleOrder(
        asked.module,
        asked.class_path,
        {**kept, **asked.parameters},
        {name: key for name, key in before.inputs.items() if name in {one.name for one in ports.inputs}},
        {name: key for name, key in before.outputs.items() if name in {one.name for one in ports.outputs}},
    )


def _unless_closed(loop: asyncio.AbstractEventLoop, changed: asyncio.Event) -> None:
    """Set the event in its loop; a round may end later than the loop."""
    if not loop.is_closed():
        loop.call_soon_threadsafe(changed.set)
