"""A component on the local bus, in virtual time, and who watches it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Annotated, Any

import msgspec

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import (
    ComponentState,
)
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message

WALKER = "resource_pool/walker"


TOWER = "ui_console/tower"


READY_S = 0.5  # virtual; by then everybody is ready who can be


class Poke(Message, frozen=True):
    """Do something: named here, so that one class serves all tests."""

    what: str


class Poked(Message, frozen=True):
    count: int


class TooSteep(Refusal):
    code = "test.steep"
    remedy = "Choose a flatter way."


class Gait(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    step_s: Annotated[float, msgspec.Meta(gt=0.0)] = 0.5
    slope: float = 0.0
    name: str = "trot"


class Walker(Component[Gait]):
    """Notes every hook in ``diary`` and fails in the hooks that the test names, with ``KeyError`` or ``by``."""

    parameters_type = Gait
    accepts = Poke
    registers = False

    def __init__(self, *args: Any, stumble: str = "", hold: str = "", by: BaseException | None = None) -> None:
        super().__init__(*args)
        self.stumble, self.hold, self.by = stumble, hold, by
        self.diary: list[str] = []
        self.pokes = 0
        self.odd: dict[Any, Any] = {}  # further statistics, as a beginner may return them
        self.is_over = False

    async def at(self, hook: str) -> None:
        self.diary.append(f"{hook} {self.state}")
        if self.stumble == hook:
            raise self.by or KeyError(hook)
        if self.hold == hook:
            await asyncio.Event().wait()

    async def connect(self) -> None:
        await self.at("connect")

    async def serve(self) -> None:
        try:
            await self.at("serve")
        except asyncio.CancelledError:
            self.diary.append(f"serve cancelled {self.state}")
            raise

    async def drain(self) -> None:
        await self.at("drain")

    def parameters_changed(self) -> None:
        if self.parameters.slope > 1.0:
            raise TooSteep(f"{self.parameters.slope}")
        if self.stumble == "change":
            raise self.by or KeyError("change")
        self.diary.append(f"step {self.parameters.step_s:g} s")

    def statistics(self) -> dict[str, float]:
        if self.stumble == "statistics":
            raise self.by or KeyError("statistics")
        return {"pokes": self.pokes, **self.odd}

    async def answer(self, asked: Envelope[Any]) -> Message:
        self.pokes += 1
        match asked.body.what:
            case "stumble":
                raise self.by or KeyError("poked")
            case "refuse":
                raise TooSteep("no")
            case "task":
                self.start_task(self.at("task"), "task")
            case "deaf":
                self.start_task(self.go_on(), "deaf")
            case "chain":
                self.start_task(self.note_later(), "note")
            case "close":
                await self.bus.close()
            case "end":
                self.end("poked")
        return Poked(self.pokes)

    async def go_on(self) -> None:
        """Poll as a task does that excepts everything, until the test is over."""
        while not self.is_over:
            with contextlib.suppress(BaseException):
                await self.clock.sleep_s(0.1)

    async def note_later(self) -> None:
        await self.clock.sleep_s(0.01)
        self.publish_event("way", "was walked")
        self.report("walked")


class Quiet(Component[Any]):
    """Overrides nothing."""

    registers = False


class Stage:
    """A network with a walker on it, its published states, its token's changes, and a component that asks."""

    def __init__(self, **walker: Any) -> None:
        self.network, self.clock = LocalNetwork(), VirtualClock()
        self.tower: Bus = self.network.join(TOWER, self.clock)
        self.observed: list[str] = []
        self.states: list[ComponentState] = []
        self.tower.subscribe(WALKER, Conversation.STATUS, ComponentState, self.heard)
        self.tower.watch_alive(WALKER, lambda _address, alive: self.observed.append("token" if alive else "no token"))
        self.walker = Walker(launch(), self.network.join(WALKER, self.clock), self.clock, **walker)

    def heard(self, envelope: Envelope[ComponentState]) -> None:
        self.states.append(envelope.body)
        self.observed.append(str(envelope.body.state))

    async def begin(self) -> asyncio.Task[None]:
        life = asyncio.create_task(self.walker.run())
        await asyncio.wait({life}, timeout=READY_S)
        return life

    async def ask(self, question: Message, reply: type[Any]) -> Any:
        return await self.tower.ask(WALKER, question, reply, within_s=5.0)


def launch(**changed: Any) -> Launch:
    as_usual = Launch("local", Subsystem.RESOURCE_POOL, "walker", "walker", "x:Walker", "here", "", 0.0, 1.0)
    return msgspec.structs.replace(as_usual, **{"requester": TOWER, **changed})


def live(law: Coroutine[Any, Any, None]) -> None:
    run_virtual(law)
