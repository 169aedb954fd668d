"""The exchange of a behavior's class at run time: two implementations in one component.

Rules of this file:

* Exactly one implementation is in charge: the gates of their buses are never both open. While the new one warms up, the
old one is in charge; while the new one is on trial, the new one is.
* Both receive all messages and all notices of grants. So the other one can take charge between two commands without a
new request: name, path, ARC and epochs belong to the component and do not change.
* The new one takes charge while no command of the old one is in progress. It gets the old one's values of the
attributes that both classes name in ``hands_over``.
* If the new one fails in any way, the old one takes charge again at once, and the new one ends as if it were killed.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Mapping
from dataclasses import dataclass
from functools import partial

import msgspec

from backbone.component.log_level import LogLevel
from backbone.errors import LinkError, Refusal, complaint
from backbone.exchange import ExchangeRunning, SwapClass, Swapped
from backbone.exchange_answers import ExchangeAnswers
from backbone.exchange_course import ExchangeCourse, ExchangePhase, ExchangeRules, class_path_of, remark_on_file
from backbone.launcher.messages import TakeBranch
from backbone.placer.messages import ReviseStart
from backbone.placer.revising import revise_start
from backbone.reading_anew import ReadAnew, read_anew
from backbone.waiting import end_tasks
from backbone.wire import Envelope, Message
from mission_control.gated_bus import without_exit
from mission_control.implementation import Implementation, Load, check_exchangeable, handed_over, made_beside
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import AskBeat, Resumed, Suspended

log = logging.getLogger(__name__)

LOOK_EVERY_S = 0.05  # chosen: a person sees no delay; seconds of the machine


@dataclass(slots=True)
class _BehaviorExchange:
    asked: SwapClass
    old: Implementation
    new: Implementation
    course: ExchangeCourse


class BehaviorExchanges:
    """The implementations of one behavior; one of them is in charge.

    Args:
        load: Returns the class of a class path.
    """

    def __init__(self, first: Implementation, load: Load) -> None:
        self.present = first
        """The implementation in charge."""
        self._load = load
        self._lives: dict[Implementation, asyncio.Task[None]] = {}
        self._exchange: _BehaviorExchange | None = None
        self._is_busy = False
        self._news = asyncio.Event()
        self._copying: set[asyncio.Task[None]] = set()
        self._answers = ExchangeAnswers()

    async def run(self, life: Coroutine[object, None, None]) -> None:
        """Run until the implementation in charge has ended; raise the bug that ended it."""
        first = self.present
        first.gate.route, first.gate.bus.on_bug = self.answer, self._bug
        self._begin(first, life)
        try:
            while not self._lives[self.present].done():
                self._news.clear()
                await self._news.wait()
            await self._lives[self.present]
        finally:
            await end_tasks(*self._lives.values(), *self._copying)
            await first.gate.bus.close()

    def _bug(self, bug: BaseException) -> None:
        self.present.fail(bug)

    def _begin(self, one: Implementation, life: Coroutine[object, None, None]) -> None:
        self._lives[one] = asyncio.create_task(life, name=f"life of {one.launch.address}")
        self._lives[one].add_done_callback(lambda ended: self._ended(one, ended))

    def _ended(self, one: Implementation, life: asyncio.Task[None]) -> None:
        if not life.cancelled():
            bug = life.exception()
            if bug is not None or one is not self.present:  # the implementation in charge ends the component
                self.failed(one, bug or RuntimeError("it ended"))
        self._news.set()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer through the implementation in charge; the other one also gets notices of grants and of the tree."""
        if isinstance(asked.body, SwapClass):
            return await self.swap(asked.body)
        beside = self._beside
        if beside is not None and isinstance(asked.body, Resumed | Suspended | AskBeat | TakeBranch):
            copying = asyncio.create_task(self._copy(beside, asked), name=f"copy for {beside.launch.address}")
            self._copying.add(copying)
            copying.add_done_callback(self._copying.discard)
        present = self.present
        try:
            return await present.gate.answer(asked)
        except (Refusal, LinkError):
            raise
        except Exception as bug:
            present.fail(bug)
            if self.present is present:
                raise
            return await self.present.gate.answer(asked)

    async def _copy(self, beside: Implementation, asked: Envelope[Message]) -> None:
        try:
            await beside.gate.answer(asked)
        except (Refusal, LinkError) as error:
            log.info("%s beside the one in charge: %s", beside.launch.address, error)
        except Exception as bug:
            beside.fail(bug)

    @property
    def _beside(self) -> Implementation | None:
        going = self._exchange
        if going is None or going.course.is_over:
            return None
        return going.old if going.course.new_works else going.new

    def failed(self, one: Implementation, bug: BaseException) -> None:
        """Record that an implementation ends because of this bug."""
        going = self._exchange
        if going is None:
            return
        now_s = one.clock.now_s()
        if one is going.new:
            going.course.fail(now_s, complaint(bug))
        elif going.course.new_works:
            told = f"the old one failed beside it and is gone: {complaint(bug)}"
            going.course.end(ExchangePhase.PROVED, now_s, told)
        else:
            going.course.fail(now_s, "the old one ended")

    def may_finish(self, one: Implementation, status: BehaviorStatus, payload: Mapping[str, object]) -> bool:
        """Return whether an implementation may finish; a new one that finishes with a failure has failed its trial."""
        going = self._exchange
        if going is None or going.course.is_over:
            return True
        if one is going.new and status is BehaviorStatus.FAILURE:
            detail = payload.get("detail")
            going.course.fail(one.clock.now_s(), f"it finished: {status}" + (f": {detail}" if detail else ""))
            return False
        if one is going.new and going.course.new_works:
            going.course.end(ExchangePhase.PROVED, one.clock.now_s())
        if one is going.old and not going.course.new_works:
            going.course.fail(one.clock.now_s(), "the old one finished before it was ready")
        return bool(one.gate.is_open)

    async def swap(self, asked: SwapClass) -> Swapped:
        """Exchange the class; return when the new one has passed its trial, or the old one is back.

        Raises:
            ExchangeRunning: Another exchange of this behavior is still running.
            NotExchanged: This behavior cannot be exchanged in its present state.
            WrongClass: The class cannot be imported or created, or is not a suitable behavior.
            WrongParameter: The class has no such parameters.
            ValuesChanged: The new file declares classes of values differently.
            UnknownExchange: The request is repeated, and this process did not get it before.
        """
        return await self._answers.answer(asked, lambda: self._swap_one(asked))

    async def _swap_one(self, asked: SwapClass) -> Swapped:
        if self._is_busy:
            raise ExchangeRunning(f"{self.present.launch.name} is being exchanged")
        self._is_busy = True
        try:
            return await self._swap(asked)
        except Refusal as refusal:
            self._tell(f"is not exchanged: {refusal.detail}", LogLevel.WARNING)
            raise
        finally:
            self._is_busy, self._exchange = False, None

    async def _swap(self, asked: SwapClass) -> Swapped:
        old = self.present
        check_exchangeable(old)
        anew = await read_anew(asked.class_path, self._load)  # it acts on while its file is imported
        try:
            new = made_beside(old, asked, anew.kind)
        except Refusal:
            anew.undo()
            raise
        by = f" for {asked.user}" if asked.user else ""
        self._tell(f"{asked.class_path} warms beside {class_path_of(old)}{by}")
        rules = ExchangeRules(asked.prove_s, asked.ready_within_s)
        course = ExchangeCourse(rules, self._changed, old.clock.now_s())
        going = self._exchange = _BehaviorExchange(asked, old, new, course)
        self._begin(new, without_exit(new.run()))
        await self._until_over(going)
        remark = await (self._proved(going) if course.phase is ExchangePhase.PROVED else self._returned(going, anew))
        return course.answer(old.clock.now_s(), remark)

    async def _until_over(self, going: _BehaviorExchange) -> None:
        course, clock = going.course, going.old.clock
        while not course.is_over:
            is_warm = course.phase is ExchangePhase.WARMING and going.new.has_begun
            if is_warm and course.tried(clock.now_s(), lambda: bool(going.new.is_ready())):
                await self._take_over(going)
            course.let_pass(clock.now_s())
            if not course.is_over:
                left_s = max(0.0, course.due_s - clock.now_s())
                await clock.sleep_s(min(LOOK_EVERY_S * clock.rate, left_s))

    async def _take_over(self, going: _BehaviorExchange) -> None:
        """Put the new implementation in charge, between two commands."""
        old, new, course = going.old, going.new, going.course
        old.gate.shut()
        await old.gate.wait_quiet()
        if course.is_over:
            return
        now_s = old.clock.now_s()
        course.receive(now_s, partial(handed_over, old, new))
        course.switch(now_s)

    def _changed(self) -> None:
        """Put exactly the implementation in charge that the course of the exchange names."""
        going = self._exchange
        assert going is not None  # noqa: S101  the course of this exchange has changed
        works, beside = (going.new, going.old) if going.course.new_works else (going.old, going.new)
        beside.stand_by()
        self._tell_of_commands(going)
        self.present = works
        works.take_charge()
        self._news.set()
        if going.course.phase is ExchangePhase.PROVING:
            self._tell(f"{going.asked.class_path} is in charge, and has to prove itself", LogLevel.INFO)
        elif going.course.is_over and beside in self._lives:
            self._lives[beside].cancel()

    def _tell_of_commands(self, going: _BehaviorExchange) -> None:
        """Let the old implementation know each command of the new one that it may have to go on after."""
        gate = going.new.gate
        gate.on_command = partial(self._obeyed, going.old) if going.course.phase is ExchangePhase.PROVING else None
        if going.course.phase is ExchangePhase.RETURNED:
            for command in gate.under_way:
                self._obeyed(going.old, command)

    def _obeyed(self, old: Implementation, command: Message) -> None:
        try:
            old.robot_obeyed(command)
        except Exception as bug:
            old.fail(bug)

    async def _returned(self, going: _BehaviorExchange, anew: ReadAnew[type[Implementation]]) -> str:
        anew.undo()
        await self._forget(going.new)
        old, new = class_path_of(going.old), going.asked.class_path
        self._tell(going.course.outcome(old, new), LogLevel.WARNING)
        return remark_on_file(going.old.launch.name, old, new)

    async def _proved(self, going: _BehaviorExchange) -> str:
        await self._forget(going.old)
        going.course.rounds = going.new.gate.commands
        self._tell(going.course.outcome(class_path_of(going.old), going.asked.class_path))
        new = going.new
        order = ReviseStart(new.launch.name, msgspec.to_builtins(new.parameters), going.asked.class_path)
        return await revise_start(new.gate.bus, self.present.clock, order)

    async def _forget(self, one: Implementation) -> None:
        life = self._lives[one]
        await end_tasks(life)
        del self._lives[one]

    def _tell(self, what: str, level: LogLevel = LogLevel.NOTICE) -> None:
        self.present.publish_event(self.present.launch.name, what, level)
        self.present.report(what)
