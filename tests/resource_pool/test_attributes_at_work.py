"""What asks for resources can be seen and changed while it runs, and everybody plans by the new values."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from pool_on_local_network import Owner, Pool, a_pool

from backbone.addresses import LAUNCHER, RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.command_line.attributes import WrongAttribute, attributes_of, change
from backbone.component.messages import Parameters, SetParameter, WrongParameter
from backbone.keys import Conversation
from backbone.launcher.messages import AskTree, Tree
from backbone.nameserver.messages import UnknownName
from backbone.rc_manager.messages import FixedRules, TraceLine
from backbone.scheduling.requests import MissingRuntime, NotMovable, PathNode
from resource_pool.messages import NeedsRestart

ROBOTS = ["scout1", "scout2", "radio"]

Scene = Callable[[Pool, Owner, Owner], Awaitable[None]]


@asynccontextmanager
async def two_rivals(mission: Any) -> AsyncIterator[tuple[Pool, Owner, Owner]]:
    """Give a pool in which ``high``, below a branch of higher priority, keeps scout1 from ``low``."""
    async with a_pool(mission, ROBOTS) as pool:
        high, low = await pool.owner("high"), await pool.owner("low")
        for owner, branch in ((high, PathNode("above", 5)), (low, PathNode("below", 1))):
            path = [PathNode("local", 10), branch, PathNode(owner.name, 1)]
            await pool.arc(owner, "drive", "scout1", path=path, maximum_runtime_s=8.0)
        await pool.clock.sleep_s(1.0)
        assert (high.heard(), low.heard()) == (["Resumed"], [])
        yield pool, high, low


@pytest.fixture
def play(local_mission: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with two_rivals(local_mission) as (pool, high, low):
                await scene(pool, high, low)

        run_virtual(main())

    return run


async def set_(pool: Pool, name: str, attribute: str, value: Any) -> list[str]:
    return await change(pool.ear, name, attribute, value, "somebody")


def test_everything_an_owner_asks_for_can_be_seen(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        shown = await attributes_of(pool.ear, "high")
        assert shown.parameters == {}
        text = "\n".join(shown.lines())
        assert "high-drive: running, for mission_control/high" in text
        assert "priority           1 (local:10/above:5/high:1)" in text
        assert "minimum_runtime_s  5\n" in text
        assert "maximum_runtime_s  8\n" in text
        assert "scout1             for itself alone" in text
        assert "radio              drive: 2 ms every 50 ms, 4.0% of its time" in text
        assert shown.of("parent") == ["high-drive: parent is above"]
        plain = json.loads(json.dumps(shown.to_json()))["requests"][0]
        assert plain["uses"]["scout1"] == []
        assert plain["uses"]["radio"][0]["period_s"] == 0.05
        assert plain["path"][1] == {"name": "above", "priority": 5}

    play(scene)


def test_a_branch_shows_all_that_is_asked_for_below_it_and_an_rc_its_parameters(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        assert [one.arc for one in (await attributes_of(pool.ear, "below")).requests] == ["low-drive"]
        assert len((await attributes_of(pool.ear, "local")).requests) == 2
        robot = await attributes_of(pool.ear, "scout1")
        assert robot.requests == []
        assert robot.of("network_id") == ["scout1: network_id is 1"]
        with pytest.raises(UnknownName, match="scout1"):
            await attributes_of(pool.ear, "scuot1")
        with pytest.raises(WrongAttribute):
            robot.of("color")

    play(scene)


def test_a_changed_priority_plans_anew_at_once(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        told = await set_(pool, "below", "priority", 9)
        assert told == ["below: priority is 9", "  low-drive has local:10/below:9/low:1"]
        await pool.clock.sleep_s(0.5)
        assert high.heard()[-1] == "Suspended"
        assert low.heard() == ["Resumed"]

    play(scene)


def test_a_moved_subtree_takes_turns_with_its_new_siblings(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        await pool.clock.sleep_s(9.0)
        assert low.heard() == []
        told = await set_(pool, "low", "parent", "above")
        assert told == ["low: parent is above", "  low-drive has local:10/above:5/low:1"]
        await pool.clock.sleep_s(0.5)
        assert low.heard() == ["Resumed"]
        await pool.clock.sleep_s(6.0)
        assert high.heard()[-1] == "Resumed"

    play(scene)


def test_a_changed_run_time_counts_even_if_the_owner_wants_no_time_at_the_same_moment(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        arc, shorter = low.arcs["low-drive"], SetParameter("minimum_runtime_s", 3.0)
        await asyncio.gather(pool.ear.ask(arc.address, shorter, Parameters, within_s=1), arc.idle())
        await pool.clock.sleep_s(0.5)
        assert (await attributes_of(pool.ear, "low")).requests[0].minimum_runtime_s == 3.0

    play(scene)


def test_a_changed_run_time_counts_from_the_next_slice_on(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        lines: list[dict[str, Any]] = []
        pool.ear.subscribe(RC_MANAGER, Conversation.EVENTS, TraceLine, lambda said: lines.append(said.body.line))
        await set_(pool, "low", "parent", "above")
        assert await set_(pool, "high", "minimum_runtime_s", 2.0) == ["high-drive: minimum_runtime_s is 2.0"]
        await pool.clock.sleep_s(30.0)
        of_high = [line for line in lines if line.get("arc") == "high-drive"]
        revokes, grants = ([line["t"] for line in of_high if line["ev"] == what] for what in ("revoke", "grant"))
        assert revokes[0] == pytest.approx(5.0, abs=0.1)  # the slice that ran already
        lengths = [end_s - begin_s for begin_s, end_s in zip(grants, revokes[1:], strict=False)]
        assert len(lengths) >= 3
        assert lengths == pytest.approx([2.0] * len(lengths), abs=0.1)

    play(scene)


def test_a_changed_run_time_outlives_the_rc_manager(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        await set_(pool, "high-drive", "maximum_runtime_s", 20.0)
        await pool.kill("rc_manager")
        await pool.clock.sleep_s(0.3)
        await pool.manager()
        await pool.clock.sleep_s(1.0)
        assert (await attributes_of(pool.ear, "high")).of("maximum_runtime_s")[-1].endswith("is 20")

    play(scene)


def test_priorities_and_places_an_operator_set_outlive_the_rc_manager(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        await set_(pool, "low", "parent", "above")
        await set_(pool, "above", "priority", 7)
        await set_(pool, "low", "priority", 3)
        await pool.clock.sleep_s(1.0)
        assert low.heard() == ["Resumed"]
        before = (await attributes_of(pool.ear, "local")).requests
        await pool.kill("rc_manager")
        await pool.clock.sleep_s(0.3)
        await pool.manager()
        await pool.clock.sleep_s(1.0)
        after = (await attributes_of(pool.ear, "local")).requests
        assert {one.arc: one.path for one in after} == {one.arc: one.path for one in before}
        assert {one.arc: [node.priority for node in one.path] for one in after} == {
            "high-drive": [10, 7, 1],
            "low-drive": [10, 7, 3],
        }
        assert low.heard() == ["Resumed"]  # it ran on

    play(scene)


def test_what_makes_no_sense_is_refused_and_changes_nothing(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        before = (await attributes_of(pool.ear, "local")).requests
        for name, attribute, value, refusal in [
            ("high", "priority", "much", WrongAttribute),
            ("high", "priority", True, WrongAttribute),
            ("above", "parent", "high", NotMovable),
            ("above", "minimum_runtime_s", 3.0, WrongAttribute),
            ("high", "minimum_runtime_s", 0.0, MissingRuntime),
            ("high", "minimum_runtime_s", 9.0, MissingRuntime),
            ("high", "minimum_runtime_s", "long", WrongParameter),
            ("high-drive", "owner", "mission_control/low", NeedsRestart),
            ("rc_manager", "policy", "strict", FixedRules),
            ("rc_manager", "policy", "sloppy", WrongParameter),
        ]:
            with pytest.raises(refusal):
                await set_(pool, name, attribute, value)
        assert (await attributes_of(pool.ear, "local")).requests == before
        assert pool.running["rc_manager"].parameters.policy == "no_delay"

    play(scene)


def test_a_priority_of_a_behavior_of_the_tree_that_does_not_run_can_be_set(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        async def answer(_asked: Any) -> Tree:
            return Tree(1, '<mission><behaviors><behavior name="later"/></behaviors></mission>')

        launcher = pool.network.join(LAUNCHER, pool.clock)
        launcher.serve(LAUNCHER, AskTree, answer)
        assert "its priority is 3" in (await set_(pool, "later", "priority", 3))[0]
        with pytest.raises(UnknownName):
            await set_(pool, "latter", "priority", 3)
        await launcher.close()

    play(scene)


def test_a_priority_of_one_who_has_not_asked_yet_holds_when_it_does(play: Any) -> None:
    async def scene(pool: Pool, high: Owner, low: Owner) -> None:
        with pytest.raises(UnknownName):
            await set_(pool, "laet", "priority", 50)
        late = await pool.owner("late")
        [told] = await set_(pool, "late", "priority", 50)
        assert "when it does" in told
        await pool.arc(late, "drive", "scout1", path=[PathNode("local", 10), PathNode("late", 1)])
        await pool.clock.sleep_s(0.5)
        assert late.heard() == ["Resumed"]

    play(scene)
