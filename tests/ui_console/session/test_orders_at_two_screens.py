"""A robot under an order at one screen of a person follows that person to the other screen, too."""

from __future__ import annotations

from orders_on_a_mission import BEN, CONSOLE, ENDED, Operator, play


def test_a_robot_under_an_order_follows_its_person_to_another_screen() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ordered(15.0)
        await anna.ben_waits(priority=100)
        await anna.state_becomes(ENDED)
        await anna.until(lambda: anna.grantee() == f"{BEN}-drive")
        since_s = anna.now_s
        await anna.running.clock.sleep_s(5.0)
        assert anna.ben.is_held
        assert [arc for arc in anna.grants(since_s=since_s) if arc.startswith(CONSOLE)] == []

    play(scene, other="anna")


def test_an_order_that_is_newer_than_the_claim_at_the_other_screen_has_the_robot() -> None:
    async def scene(anna: Operator) -> None:
        await anna.holds()
        await anna.ben_waits(priority=100)
        await anna.until(lambda: anna.ben.is_held)
        await anna.running.clock.sleep_s(1.0)
        await anna.ordered(15.0)
        await anna.running.clock.sleep_s(3.0)
        assert anna.grantee() == f"{CONSOLE}-order-1-drive"
        assert not anna.ben.is_held

    play(scene, other="anna")
