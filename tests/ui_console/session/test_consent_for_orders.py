"""An operator asks for a robot that another one has by an order, or gives an order while being asked."""

from __future__ import annotations

import pytest
from orders_on_a_mission import BEN, ENDED, Operator, play

from ui_console.model.consent import Settled, Sought
from ui_console.model.events import ConsentHeard


async def ben_asks(anna: Operator) -> Sought:
    anna.ben.begin_ask_consent("mine is stuck")
    await anna.until(lambda: any(isinstance(event, Sought) for event in anna.shown))
    return next(event for event in anna.shown if isinstance(event, Sought))


def heard_by_ben(anna: Operator) -> list[tuple[bool, str]]:
    return [(event.is_given, event.reason) for event in anna.others if isinstance(event, ConsentHeard)]


@pytest.mark.parametrize("is_at_stick", [True, False])
def test_a_robot_under_an_order_is_asked_for_and_given_back(is_at_stick: bool) -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(15.0)
        if not is_at_stick:
            await anna.console.switch("scout2")
            await anna.holds("scout2")
        await anna.ben_waits()
        sought = await ben_asks(anna)
        assert (sought.user, sought.robot, sought.why) == ("ben", "scout1", "mine is stuck")
        anna.console.decide(True)
        await anna.until(lambda: anna.ben.is_held and heard_by_ben(anna))
        assert anna.grantee() == f"{BEN}-drive"
        assert anna.states()[-1] is ENDED
        assert heard_by_ben(anna) == [(True, "")]
        assert anna.console.is_held is not is_at_stick

    play(scene)


def test_an_operator_who_gives_an_order_while_asked_has_not_given_the_robot_away() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ben_waits()
        await ben_asks(anna)
        await anna.ordered(15.0)
        assert not any(isinstance(event, Settled) for event in anna.shown)
        anna.console.decide(False)
        await anna.until(lambda: heard_by_ben(anna))
        assert heard_by_ben(anna) == [(False, "")]
        assert not anna.ben.is_held

    play(scene)


def test_a_robot_under_an_order_that_is_given_back_anyway_is_a_yes() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(15.0)
        await anna.ben_waits()
        await ben_asks(anna)
        await anna.console.give_back()
        await anna.until(lambda: heard_by_ben(anna))
        assert heard_by_ben(anna) == [(True, "released")]

    play(scene)
