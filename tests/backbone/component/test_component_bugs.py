"""A bug ends a component, is told, and is raised; a refusal is none."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import pytest
from component_stage import TOWER, Poke, Poked, Stage, TooSteep, live

from backbone.component.component import DRAIN_WITHIN_S
from backbone.component.messages import (
    LifeState,
    ParameterBug,
    Parameters,
    SetParameter,
)
from backbone.component.own_tasks import TASKS_END_WITHIN_S
from backbone.errors import LinkError, NoResponder
from backbone.keys import Conversation
from backbone.waiting import end_tasks

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


def test_a_bug_in_a_change_ends_it_and_the_requester_learns_why() -> None:
    """Otherwise ``set`` says that no component answered, and not which value holds."""
    bug = "walker has a bug that ends it when step_s is 2.0: KeyError: 'change' ("
    afterwards = "); if it is started again, step_s is 0.5"

    async def law() -> None:
        stage = Stage(stumble="change")
        life = await stage.begin()
        with pytest.raises(ParameterBug) as refused:
            await stage.ask(SetParameter("step_s", 2.0), Parameters)
        first, place, last = refused.value.detail.partition("component_stage.py, line ")
        assert (first[: len(bug)], place != "", last[-len(afterwards) :]) == (bug, True, afterwards)
        with pytest.raises(KeyError, match="change"):
            await life
        assert stage.states[-1].state is LifeState.FAILED

    live(law())


class Panic(BaseException):
    """As libraries in another language raise."""


NO_EXCEPTIONS = [Panic("no memory"), SystemExit("no camera"), BaseExceptionGroup("", [asyncio.CancelledError()])]
SAID = {Panic: "Panic: no memory", SystemExit: "SystemExit: no camera", BaseExceptionGroup: "BaseExceptionGroup"}


@pytest.mark.parametrize("by", NO_EXCEPTIONS, ids=lambda by: type(by).__name__)
@pytest.mark.parametrize("where", ["connect", "serve", "task", "answer", "listener", "drain"])
def test_what_is_no_exception_is_a_bug_like_any_other(where: str, by: BaseException) -> None:
    """Otherwise it ends the event loop, or the component without its drain and without a reason."""

    def listen(_heard: object) -> None:
        raise by

    async def law() -> None:
        stage = Stage(stumble=where, by=by, hold="" if where == "serve" else "serve")
        life = await stage.begin()
        match where:
            case "task":
                await stage.ask(Poke("task"), Poked)
            case "answer":
                with pytest.raises(NoResponder):
                    await stage.ask(Poke("stumble"), Poked)
            case "listener":
                stage.walker.bus.subscribe(TOWER, Conversation.EVENTS, Poked, listen)
                stage.tower.publish(TOWER, Conversation.EVENTS, Poked(1))
            case "drain":
                stage.walker.end("enough")
        with pytest.raises(RuntimeError, match=SAID[type(by)]):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.states[-1].state is LifeState.FAILED
        assert SAID[type(by)] in stage.states[-1].feedback
        assert where == "connect" or stage.walker.diary.count("drain draining") == 1

    live(law())


@pytest.mark.parametrize("where", ["connect", "drain"])
def test_a_cancellation_that_nobody_asked_for_is_a_bug_of_the_hook(where: str) -> None:
    """As of the result of a cancelled task. Otherwise the component ends as if all were well, or not at all."""

    async def law() -> None:
        stage = Stage(stumble=where, by=asyncio.CancelledError(), hold="serve")
        life = await stage.begin()
        stage.walker.end("enough")
        with pytest.raises(RuntimeError, match=f"walker:{where} raised CancelledError"):
            await life
        await stage.clock.sleep_s(0.1)
        assert stage.states[-1].state is LifeState.FAILED

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


def test_an_answer_that_closes_the_components_bus_is_a_bug_with_its_line() -> None:
    """Otherwise the component stays ready, and its mission only says that it cannot be reached."""

    async def law() -> None:
        stage = Stage()
        life = await stage.begin()
        with pytest.raises(LinkError):
            await stage.ask(Poke("close"), Poked)
        with pytest.raises(RuntimeError, match="only the end of a component closes its bus") as bug:
            await life
        assert stage.observed[-3:] == ["draining", "failed", "no token"]
        assert "component_stage.py" in [Path(entry.path).name for entry in bug.traceback]

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


def test_a_cancellation_that_nobody_asked_for_is_a_bug_and_one_that_somebody_asked_for_is_none() -> None:
    async def cut_off() -> None:
        raise asyncio.CancelledError

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.start_task(asyncio.sleep(60.0), "asked").cancel()
        await stage.clock.sleep_s(0.1)
        assert stage.walker.state is LifeState.READY
        stage.walker.start_task(cut_off(), "cut off")
        with pytest.raises(RuntimeError, match="walker:cut off raised CancelledError"):
            await life
        assert stage.states[-1].state is LifeState.FAILED

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


@pytest.mark.parametrize("ordered", [True, False])
def test_a_task_that_goes_on_after_its_cancellation_holds_up_neither_drain_nor_end(ordered: bool) -> None:
    """Otherwise the hardware stays as it is after a bug elsewhere, and the creator does not restart the component."""

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        await stage.ask(Poke("deaf"), Poked)
        if ordered:
            stage.walker.end("enough")
        else:
            stage.walker.fail(KeyError("bug"))
        await asyncio.wait({life}, timeout=TASKS_END_WITHIN_S + 0.1)
        assert life.done()
        assert isinstance(life.exception(), KeyError) is not ordered
        assert stage.walker.diary[-1] == "drain draining"
        assert "walker:deaf goes on after its cancellation" in [one.what for one in stage.walker.story.of("walker")]
        stage.walker.is_over = True
        await stage.clock.sleep_s(0.2)

    live(law())


@pytest.mark.parametrize("ordered", [True, False])
def test_after_a_bug_a_drain_that_never_returns_does_not_hold_up_the_end(ordered: bool) -> None:
    """A creator limits only ends that were ordered, so the component limits this one itself."""

    async def law() -> None:
        stage = Stage(hold="drain")
        life = await stage.begin()
        if ordered:
            stage.walker.end("enough")
            await asyncio.wait({life}, timeout=2 * DRAIN_WITHIN_S)
            assert not life.done(), "its creator ends it, as soon as the order says"
            await end_tasks(life)
            return
        stage.walker.fail(KeyError("bug"))
        await asyncio.wait({life}, timeout=DRAIN_WITHIN_S + 0.1)
        assert isinstance(life.exception(), KeyError)
        await stage.clock.sleep_s(0.1)
        assert stage.states[-1].state is LifeState.FAILED
        assert stage.observed[-1] == "no token"

    live(law())
