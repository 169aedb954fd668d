"""The nameserver among components on one network, on virtual time."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import (
    AskStatistics,
    AskStory,
    ComponentState,
    LifeState,
    NameTaken,
    Register,
    Registered,
    Statistics,
    Story,
)
from backbone.component.name_claim import REGISTER_WITHIN_S
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.nameserver.messages import (
    Appeared,
    Components,
    Disappeared,
    ListComponents,
    Resolve,
    Resolved,
    UnknownName,
)
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem


class Probe(Component[NoParameters]):
    """A component that takes its time to connect."""

    connect_s = 0.0

    async def connect(self) -> None:
        await self.clock.sleep_s(self.connect_s)


class SlowProbe(Probe):
    connect_s = 3.0


class BrokenProbe(Probe):
    async def connect(self) -> None:
        raise NoResponder("no device")


def probe(network: LocalNetwork, name: str = "scout1", kind: type[Probe] = Probe, host: str = "a") -> Probe:
    launch = Launch("local", Subsystem.RESOURCE_POOL, name, "scout", "tests:Probe", host, "", 0.0, 1.0)
    clock = VirtualClock()
    return kind(launch, network.join(launch.address, clock), clock)


def nameserver(network: LocalNetwork, run_directory: str = "", endpoint: str = "") -> Nameserver:
    address = (Subsystem.BACKBONE, "nameserver", "nameserver")
    launch = Launch("local", *address, "x:Y", "a", endpoint, 0.0, 1.0, run_directory=run_directory)
    clock = VirtualClock()
    return Nameserver(launch, network.join(launch.address, clock), clock)


async def listed(network: LocalNetwork) -> Components:
    return await network.join("ui_console/asker", VirtualClock()).ask(
        NAMESERVER, ListComponents(), Components, within_s=1
    )


def names(components: Components) -> list[str]:
    return [state.address.rpartition("/")[2] for state in components.components]


def test_a_component_is_listed_while_it_connects_and_ready_afterwards(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network:
            slow = probe(network, kind=SlowProbe)
            life = asyncio.create_task(slow.run())
            await VirtualClock().sleep_s(1.0)
            (scout,) = [state for state in (await listed(network)).components if state.type == "scout"]
            assert scout.state is LifeState.CONNECTING
            await VirtualClock().sleep_s(3.0)
            (scout,) = [state for state in (await listed(network)).components if state.type == "scout"]
            assert (scout.state, scout.since_s) == (LifeState.READY, 3.0)
            slow.end("enough")
            await life
            await asyncio.sleep(0)
            assert names(await listed(network)) == ["nameserver"]

    run_virtual(main())


def test_whoever_listens_hears_who_appears_and_disappears(local_mission: Any, beside: Any) -> None:
    async def main() -> list[object]:
        heard: list[object] = []
        async with local_mission() as network:
            bus = network.join("ui_console/asker", VirtualClock())
            bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, lambda said: heard.append(said.body))
            async with beside(probe(network)):
                await VirtualClock().sleep_s(0.1)
            await VirtualClock().sleep_s(0.1)
        return heard

    appeared, disappeared = run_virtual(main())
    assert isinstance(appeared, Appeared)
    assert (appeared.component.address, appeared.component.state) == ("resource_pool/scout1", LifeState.READY)
    assert disappeared == Disappeared("resource_pool/scout1")


def test_a_second_of_the_same_name_ends_with_the_refusal_and_is_never_heard_of(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network, beside(probe(network)):
            heard: list[ComponentState] = []
            bus = network.join("ui_console/asker", VirtualClock())
            bus.subscribe("*/*", Conversation.STATUS, ComponentState, lambda said: heard.append(said.body))
            second = probe(network, host="b")
            with pytest.raises(NameTaken) as taken:
                await second.run()
            assert (taken.value.facts["name"], taken.value.facts["host"]) == ("scout1", "a")
            await VirtualClock().sleep_s(0.1)
            assert heard == []
            resolved = await bus.ask(NAMESERVER, Resolve("scout1"), Resolved, within_s=1)
            assert (resolved.component.host, resolved.component.state) == ("a", LifeState.READY)

    run_virtual(main())


@pytest.mark.processes
def test_a_name_whose_process_was_killed_before_its_claim_stood_is_waited_for(local_mission: Any) -> None:
    """A creator that was killed while a mission came up ended the mission: its successor found its name taken."""

    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()

    async def main() -> None:
        async with local_mission() as network:
            former = network.join("resource_pool/scout1", VirtualClock())
            state = ComponentState("resource_pool/scout1", "probe", "a", dead.pid, LifeState.CONNECTING, 0.0)
            await former.ask(NAMESERVER, Register(state), Registered, within_s=1.0)
            await former.close()
            successor = probe(network, host="a")
            life = asyncio.create_task(successor.run())
            await VirtualClock().sleep_s(3.0)
            assert successor.state is LifeState.READY
            successor.end("enough")
            await life

    run_virtual(main())


def test_two_that_begin_together_do_not_both_get_the_name(local_mission: Any) -> None:
    async def main() -> list[BaseException | None]:
        async with local_mission() as network:
            both = [probe(network, kind=SlowProbe, host=host) for host in "ab"]
            lives = [asyncio.create_task(one.run()) for one in both]
            await VirtualClock().sleep_s(5.0)
            for one in both:
                one.end("enough")
            return await asyncio.gather(*lives, return_exceptions=True)

    first, second = run_virtual(main())
    assert first is None
    assert isinstance(second, NameTaken)


def test_a_component_that_fails_to_connect_leaves_its_name_free(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network:
            with pytest.raises(NoResponder):
                await probe(network, kind=BrokenProbe).run()
            async with beside(probe(network)):
                assert names(await listed(network)) == ["nameserver", "scout1"]

    run_virtual(main())


def test_a_component_gives_up_when_no_nameserver_comes() -> None:
    async def main() -> float:
        with pytest.raises(NoResponder):
            await probe(LocalNetwork()).run()
        return VirtualClock().now_s()

    assert REGISTER_WITHIN_S - 1.0 < run_virtual(main()) <= REGISTER_WITHIN_S


def test_a_component_that_begins_while_the_nameserver_restarts_is_registered(beside: Any) -> None:
    async def main() -> None:
        network = LocalNetwork()
        early = probe(network)
        life = asyncio.create_task(early.run())
        await VirtualClock().sleep_s(2.0)
        async with beside(nameserver(network)):
            await VirtualClock().sleep_s(1.0)
            assert names(await listed(network)) == ["nameserver", "scout1"]
            early.end("enough")
            await life

    run_virtual(main())


def test_a_restarted_nameserver_asks_the_living_who_they_are(tmp_path: Path) -> None:
    async def main() -> None:
        network = LocalNetwork()
        first = nameserver(network, str(tmp_path / "run"))
        lives = [asyncio.create_task(first.run())]
        scouts = [probe(network, name) for name in ("scout1", "scout2")]
        lives += [asyncio.create_task(one.run()) for one in scouts]
        await VirtualClock().sleep_s(0.1)
        assert (await listed(network)).complete
        await VirtualClock().sleep_s(4.9)
        first.end("killed")
        await lives[0]
        second = nameserver(network, str(tmp_path / "run"))
        lives.append(asyncio.create_task(second.run()))
        await VirtualClock().sleep_s(0.1)
        found = await listed(network)
        assert names(found) == ["nameserver", "scout1", "scout2"]
        assert all(state.since_s < 0.1 for state in found.components if state.type == "scout")
        assert (found.complete, found.hub_since_s) == (False, 5.0)
        with pytest.raises(NameTaken):
            await probe(network, "scout1", host="b").run()
        await VirtualClock().sleep_s(1.0)
        assert (await listed(network)).complete
        for one in (*scouts, second):
            one.end("enough")
        await asyncio.gather(*lives)

    run_virtual(main())


def test_a_token_nobody_answers_for_holds_the_list_up_only_for_a_moment(local_mission: Any) -> None:
    async def main() -> None:
        async with local_mission() as network:
            hung = network.join("resource_pool/hung", VirtualClock())

            async def never(asked: object) -> Any:
                await asyncio.Event().wait()

            hung.serve("resource_pool/hung", ListComponents, never)
            hung.declare_alive("resource_pool/hung")
            await VirtualClock().sleep_s(3.0)
            assert (await listed(network)).complete
            with pytest.raises(UnknownName):
                await hung.ask(NAMESERVER, Resolve("hung"), Resolved, within_s=1)
            await hung.close()

    run_virtual(main())


def test_a_strangers_token_does_not_end_the_hub(local_mission: Any) -> None:
    async def main() -> None:
        async with local_mission() as network:
            stranger = network.join("resource_pool/stranger", VirtualClock())
            for odd in ("a/b/c", "resource_pool/scout1/a.b", "x/y", "resource_pool/Ünfug/-.1"):
                stranger.declare_alive(odd)
            await VirtualClock().sleep_s(2.5)
            assert names(await listed(network)) == ["nameserver"]
            counted = await stranger.ask(NAMESERVER, AskStatistics(), Statistics, within_s=1)
            assert counted.values["introductions_unanswered"] == 0  # nobody can answer there: it is not even asked
            await stranger.close()

    run_virtual(main())


def test_the_nameserver_tells_what_it_counted_and_decided(local_mission: Any, beside: Any) -> None:
    async def main() -> tuple[Statistics, Story]:
        async with local_mission() as network, beside(probe(network)):
            await VirtualClock().sleep_s(0.1)
            bus = network.join("ui_console/asker", VirtualClock())
            counted = await bus.ask(NAMESERVER, AskStatistics(), Statistics, within_s=1)
            return counted, await bus.ask(NAMESERVER, AskStory("scout1"), Story, within_s=1)

    counted, story = run_virtual(main())
    assert (counted.values["components"], counted.values["registrations"]) == (2.0, 1.0)
    told = [event.what for event in story.events]
    assert told[0].startswith("registered as resource_pool/scout1 on a")
    assert told[1].startswith("appeared on a")
    assert story.events[0].cause.startswith("resource_pool/scout1#")


def test_a_hub_that_cannot_note_that_it_began_waits_as_after_a_restart(tmp_path: Path, beside: Any) -> None:
    (tmp_path / "run").touch()  # no folder can be made there

    async def main() -> None:
        network = LocalNetwork()
        async with beside(nameserver(network, str(tmp_path / "run" / "mission"))):
            assert not (await listed(network)).complete
            await VirtualClock().sleep_s(3.0)
            assert (await listed(network)).complete

    run_virtual(main())
