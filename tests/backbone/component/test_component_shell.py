"""The life of a component on the local bus, in virtual time."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from typing import Annotated, Any

import msgspec
import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import (
    AskParameters,
    AskState,
    AskStatistics,
    AskStory,
    ComponentState,
    LifeState,
    Parameters,
    SetParameter,
    Statistics,
    Stop,
    Stopping,
    Story,
    StoryEvent,
    WrongParameter,
)
from backbone.component.story import MAX_FEEDBACK_LENGTH
from backbone.errors import NoResponder, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message, UnknownMessage

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
    """Notes every hook in ``diary`` and fails in the hooks that the test names."""

    parameters_type = Gait
    accepts = Poke
    registers = False

    def __init__(self, *args: Any, stumble: str = "", hold: str = "") -> None:
        super().__init__(*args)
        self.stumble, self.hold = stumble, hold
        self.diary: list[str] = []
        self.pokes = 0

    async def at(self, hook: str) -> None:
        self.diary.append(f"{hook} {self.state}")
        if self.stumble == hook:
            raise KeyError(hook)
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
        self.diary.append(f"step {self.parameters.step_s:g} s")

    def statistics(self) -> dict[str, float]:
        return {"pokes": self.pokes}

    async def answer(self, asked: Envelope[Any]) -> Message:
        self.pokes += 1
        match asked.body.what:
            case "stumble":
                raise KeyError("poked")
            case "refuse":
                raise TooSteep("no")
            case "task":
                self.start_task(self.at("task"), "task")
            case "chain":
                self.start_task(self.note_later(), "note")
            case "end":
                self.end("poked")
        return Poked(self.pokes)

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


# Order of life


def test_the_hooks_run_in_order_and_the_world_sees_each_state() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.end("enough")
        await life
        assert stage.walker.diary == ["connect connecting", "serve ready", "serve cancelled draining", "drain draining"]
        assert stage.observed == ["ready", "token", "draining", "stopped", "no token"]
        assert stage.walker.state is LifeState.STOPPED

    live(law())


def test_whoever_sees_the_token_can_ask() -> None:
    async def law() -> None:
        stage = Stage()
        answers: list[Any] = []

        def ask_at_once(_address: str, alive: bool) -> None:
            if alive:
                asking.append(asyncio.create_task(stage.ask(AskState(), ComponentState)))

        asking: list[asyncio.Task[Any]] = []
        stage.tower.watch_alive(WALKER, ask_at_once)
        life = await stage.begin()
        answers = await asyncio.gather(*asking)
        assert [answer.state for answer in answers] == [LifeState.READY]
        stage.walker.end("enough")
        await life

    live(law())


def test_before_it_is_ready_nobody_can_ask() -> None:
    async def law() -> None:
        stage = Stage(hold="connect")
        life = await stage.begin()
        with pytest.raises(NoResponder):
            await stage.ask(AskState(), ComponentState)
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.virtual_limit(4e3)
def test_a_component_whose_work_is_done_lives_on() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.clock.sleep_s(3600.0)
        assert (await stage.ask(AskState(), ComponentState)).state is LifeState.READY
        stage.walker.end("enough")
        await life

    live(law())


def test_while_it_drains_it_still_stands_and_answers() -> None:
    """A token that fell before the hardware is safe would let a successor begin too early."""

    async def law() -> None:
        stage = Stage(hold="drain")
        life = await stage.begin()
        stage.walker.end("enough")
        await stage.clock.sleep_s(1.0)
        assert stage.observed == ["ready", "token", "draining"]
        assert (await stage.ask(AskState(), ComponentState)).state is LifeState.DRAINING
        life.cancel()
        with pytest.raises(asyncio.CancelledError):
            await life

    live(law())


def test_told_to_end_while_it_connects_it_ends_without_draining() -> None:
    async def law() -> None:
        stage = Stage(hold="connect")
        life = await stage.begin()
        stage.walker.end("SIGTERM")
        await asyncio.wait_for(life, 1.0)
        assert stage.walker.diary == ["connect connecting"]
        assert stage.observed == ["stopped"]

    live(law())


def test_told_to_end_before_it_began_it_never_appears() -> None:
    async def law() -> None:
        stage = Stage()
        stage.walker.end("SIGTERM")
        life = await stage.begin()
        await life
        assert (stage.observed, stage.walker.diary) == ([], [])

    live(law())


def test_cancelled_it_dies_like_a_killed_process() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        life.cancel()
        with pytest.raises(asyncio.CancelledError):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.observed == ["ready", "token", "no token"]
        assert "drain draining" not in stage.walker.diary

    live(law())


def test_a_component_without_hooks_lives_and_stops() -> None:
    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        quiet: Quiet = Quiet(launch(), network.join(WALKER, clock), clock)
        life = asyncio.create_task(quiet.run())
        await clock.sleep_s(READY_S)
        tower = network.join(TOWER, clock)
        with pytest.raises(UnknownMessage):
            await tower.ask(WALKER, Poke("x"), Poked, within_s=1.0)
        assert (await tower.ask(WALKER, AskParameters(), Parameters, within_s=1.0)).values == {}
        assert await tower.ask(WALKER, Stop(), Stopping, within_s=1.0) == Stopping()
        await life

    live(law())


# Stop


def test_stop_is_answered_and_ends_it() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        assert await stage.ask(Stop("the mission is over"), Stopping) == Stopping()
        await asyncio.wait_for(life, 1.0)
        assert stage.observed[-2:] == ["stopped", "no token"]
        ends = [event for event in stage.walker.story.of() if event.what.startswith("ends")]
        assert [event.what for event in ends] == ["ends: the mission is over"]
        assert ends[0].cause.startswith(f"{TOWER}#")

    live(law())


def test_stop_without_a_reason_names_who_asked() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.ask(Stop(), Stopping)
        await life
        assert f"ends: stopped by {TOWER}" in [event.what for event in stage.walker.story.of("walker")]

    live(law())


# Bugs


@pytest.mark.parametrize(
    ("where", "diary"),
    [
        ("connect", ["connect connecting"]),
        ("serve", ["connect connecting", "serve ready", "drain draining"]),
        ("drain", ["connect connecting", "serve ready", "drain draining"]),
    ],
)
def test_a_bug_in_a_hook_ends_it_failed_and_is_raised(
    where: str, diary: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    async def law() -> None:
        stage = Stage(stumble=where)
        life = await stage.begin()
        stage.walker.end("enough")
        with pytest.raises(KeyError, match=where):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.walker.diary == diary
        assert stage.states[-1].state is LifeState.FAILED
        assert stage.states[-1].feedback == f"KeyError: '{where}'"
        assert stage.observed[-1] in ("failed", "no token")

    with caplog.at_level(logging.CRITICAL):
        live(law())


def test_failed_is_said_before_the_token_falls() -> None:
    async def law() -> None:
        stage = Stage(stumble="serve")
        life = await stage.begin()
        with pytest.raises(KeyError):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.observed == ["ready", "token", "draining", "failed", "no token"]

    live(law())


def test_a_bug_in_an_answer_ends_it_and_drains_once() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        with pytest.raises(NoResponder):
            await stage.ask(Poke("stumble"), Poked)
        with pytest.raises(KeyError, match="poked"):
            await life
        assert stage.walker.diary.count("drain draining") == 1
        assert stage.states[-1].state is LifeState.FAILED

    live(law())


def test_a_bug_in_a_listener_ends_it() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.bus.subscribe(TOWER, Conversation.EVENTS, Poked, lambda event: {}[event])
        stage.tower.publish(TOWER, Conversation.EVENTS, Poked(1))
        with pytest.raises(KeyError):
            await life
        assert stage.walker.diary[-1] == "drain draining"

    live(law())


def test_a_bug_in_a_task_ends_it_and_drains_once() -> None:
    async def law() -> None:
        stage = Stage(hold="serve", stumble="task")
        life = await stage.begin()
        await stage.ask(Poke("task"), Poked)
        with pytest.raises(KeyError, match="task"):
            await life
        assert stage.walker.diary[-2:] == ["serve cancelled ready", "drain draining"]
        assert stage.states[-1].feedback == "KeyError: 'task'"

    live(law())


def test_the_first_of_two_bugs_is_the_one_raised() -> None:
    async def law() -> None:
        stage = Stage(stumble="drain", hold="serve")
        life = await stage.begin()
        with pytest.raises(NoResponder):
            await stage.ask(Poke("stumble"), Poked)
        with pytest.raises(KeyError, match="poked"):
            await life

    live(law())


def test_a_refusal_is_no_bug() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(TooSteep):
            await stage.ask(Poke("refuse"), Poked)
        assert (await stage.ask(Poke("x"), Poked)).count == 2
        stage.walker.end("enough")
        await life

    live(law())


def test_a_long_complaint_is_cut_in_the_feedback() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.fail(ValueError("x" * 10_000))
        with pytest.raises(ValueError, match="xxx"):
            await life
        assert len(stage.states[-1].feedback) == MAX_FEEDBACK_LENGTH

    live(law())


# Tasks


def test_tasks_end_with_the_component() -> None:
    async def law() -> None:
        stage = Stage(hold="task")
        life = await stage.begin()
        await stage.ask(Poke("task"), Poked)
        await stage.clock.sleep_s(0.1)
        assert "task ready" in stage.walker.diary
        stage.walker.end("enough")
        await asyncio.wait_for(life, 1.0)

    live(law())


def test_a_task_asked_for_while_it_drains_does_not_begin_and_is_no_bug() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")

        async def poke_while_draining() -> None:
            await stage.ask(Poke("task"), Poked)
            await stage.clock.sleep_s(0.1)

        stage.walker.drain = poke_while_draining  # type: ignore[method-assign]
        life = await stage.begin()
        stage.walker.end("enough")
        await life
        assert "task draining" not in stage.walker.diary
        assert stage.walker.state is LifeState.STOPPED

    live(law())


def test_a_task_can_be_started_while_it_connects() -> None:
    class Eager(Walker):
        async def connect(self) -> None:
            self.start_task(self.note_later(), "early")

    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        eager = Eager(launch(), network.join(WALKER, clock), clock)
        life = asyncio.create_task(eager.run())
        await clock.sleep_s(READY_S)
        assert [event.what for event in eager.story.of("way")] == ["was walked"]
        eager.end("enough")
        await life

    live(law())


def test_a_task_before_life_is_a_bug() -> None:
    async def law() -> None:
        stage = Stage()
        with pytest.raises(RuntimeError, match="before it connects"):
            stage.walker.start_task(stage.walker.at("task"), "early")

    live(law())


# Questions everybody answers


def test_state_says_who_and_how_it_is() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.report("climbs")
        state = await stage.ask(AskState(), ComponentState)
        assert (state.address, state.type, state.host, state.requester) == (WALKER, "walker", "here", TOWER)
        assert (state.state, state.since_s, state.feedback) == (LifeState.READY, 0.0, "climbs")
        await stage.clock.sleep_s(0.1)
        assert stage.states[-1] == state
        count = len(stage.states)
        stage.walker.report("climbs")
        stage.walker.changed()  # as after news that its state does not show
        await stage.clock.sleep_s(0.1)
        assert len(stage.states) == count, "no news was published"
        stage.walker.end("enough")
        await life

    live(law())


def test_several_reports_within_a_moment_are_published_once_with_the_last() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        count = len(stage.states)
        for feedback in ("climbs", "slips", "stands"):
            stage.walker.report(feedback)
            await stage.clock.sleep_s(0.001)
        await stage.clock.sleep_s(0.1)
        assert [state.feedback for state in stage.states[count:]] == ["stands"]
        stage.walker.end("enough")
        await life

    live(law())


def test_statistics_join_the_bus_and_the_component() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        await stage.ask(Poke("x"), Poked)
        values = (await stage.ask(AskStatistics(), Statistics)).values
        assert values["pokes"] == 1.0
        assert values["bus_answered"] == 2.0
        stage.walker.end("enough")
        await life

    live(law())


def test_a_parameter_is_set_told_and_noted() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        values = (await stage.ask(SetParameter("step_s", 0.25, "ann"), Parameters)).values
        assert values == {"step_s": 0.25, "slope": 0.0, "name": "trot"}
        assert (await stage.ask(AskParameters(), Parameters)).values == values
        assert stage.walker.diary[-1] == "step 0.25 s"
        (event,) = stage.walker.story.of("step_s")
        assert event.what == "ann set step_s from 0.5 to 0.25"
        assert event.cause.startswith(f"{TOWER}#")
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("speed", 1, "no parameter 'speed'; it has: name, slope, step_s"),
        ("step_s", "fast", "Expected `float`, got `str`"),
        ("step_s", -1.0, "> 0"),
        ("step_s", None, "got `null`"),
        ("name", 7, "Expected `str`, got `int`"),
    ],
)
def test_a_parameter_that_does_not_fit_is_refused_with_the_reason(name: str, value: Any, complaint: str) -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(WrongParameter) as refused:
            await stage.ask(SetParameter(name, value), Parameters)
        assert complaint in refused.value.detail
        assert stage.walker.parameters == Gait()
        stage.walker.end("enough")
        await life

    live(law())


def test_a_parameter_the_component_refuses_is_not_kept() -> None:
    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(TooSteep):
            await stage.ask(SetParameter("slope", 2.0), Parameters)
        assert stage.walker.parameters == Gait()
        assert stage.walker.story.of("slope") == []
        stage.walker.end("enough")
        await life

    live(law())


@pytest.mark.parametrize("parameters", [{"speed": 1}, {"step_s": "fast"}, {"step_s": 0.0}])
def test_launch_parameters_that_do_not_fit_are_refused_before_it_lives(parameters: dict[str, Any]) -> None:
    async def law() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        with pytest.raises(WrongParameter):
            Walker(launch(parameters=parameters), network.join(WALKER, clock), clock)

    live(law())


# Story


def test_the_story_names_the_causes_also_of_what_tasks_did() -> None:
    async def law() -> None:
        stage = Stage()
        logged: list[Any] = []
        stage.tower.subscribe(WALKER, Conversation.LOG, StoryEvent, lambda e: logged.append(e.body))
        life = await stage.begin()
        await stage.ask(Poke("chain"), Poked)
        await stage.clock.sleep_s(0.1)
        story = await stage.ask(AskStory("way"), Story)
        (event,) = story.events
        assert (event.what, event.where, event.cause) == ("was walked", WALKER, f"{TOWER}#1")
        assert logged == [event]
        stage.walker.end("enough")
        await life

    live(law())


def test_a_story_tells_of_whole_names_only() -> None:
    async def law() -> None:
        stage = Stage()
        book = stage.walker.story
        for what in ("connected scout1", "connected scout10", "lost my-scout1", "took resource_pool/scout1, at last"):
            book.note("radio", what)
        book.note("scout1", "moved")
        assert [event.what for event in book.of("scout1")] == [
            "connected scout1",
            "took resource_pool/scout1, at last",
            "moved",
        ]
        assert len(book.of()) == 5
        assert [event.what for event in book.of("resource_pool/scout1")] == ["took resource_pool/scout1, at last"]

    live(law())


def test_a_story_keeps_the_newest() -> None:
    async def law() -> None:
        book = Stage().walker.story
        for number in range(1000):
            book.note("x", str(number))
        kept = [event.what for event in book.of()]
        assert kept == [str(number) for number in range(1000 - len(kept), 1000)]
        assert len(kept) == 512

    live(law())
