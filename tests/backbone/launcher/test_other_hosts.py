"""The missing machines of a mission, and the commands to type there."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.command_line.cli import app
from backbone.creator.messages import CUT_OFF_ENDS_WITHIN_S
from backbone.launcher.awaited_hosts import announce_awaited_hosts, awaited_hosts
from backbone.launcher.other_hosts import OtherHosts, command_on, endpoint_for_others
from backbone.launcher.preconditions import has_address
from backbone.mission.model import Host, MissionDescription
from backbone.picture.health import HealthWord, health
from backbone.waiting import end_tasks

BASE, FAR, ATTIC = (
    Host(name="base", address="192.0.2.1"),
    Host(name="far", address="192.0.2.7", tags=("gl", "serial")),
    Host(name="attic", address="attic.example.org"),
)


def mission(*hosts: Host) -> MissionDescription:
    return MissionDescription(
        name="m", priority=1, hosts=hosts, core=(), types=(), resources=(), components=(), behaviors=(), source="m.xml"
    )


def test_hosts_with_loopback_addresses_are_this_machine() -> None:
    described = mission(BASE, Host(name="a", address="127.0.0.2"), Host(name="b", address="localhost"), FAR)
    assert [host.name for host in described.other_hosts] == ["far"]
    assert endpoint_for_others(mission(BASE)) == ""
    assert endpoint_for_others(described) == "tcp/192.0.2.1:7447"


def test_each_is_missed_until_its_creators_token_stands_and_again_when_it_falls() -> None:
    others = OtherHosts(mission(BASE, FAR, ATTIC), 1.0)
    assert others.missing == others.names == ["far", "attic"]
    assert others.token_changed("backbone/creator-far", True, 2.0)
    assert not others.token_changed("backbone/creator-far", True, 2.5)
    assert not others.token_changed("backbone/creator-base", True, 2.5)
    assert others.missing == ["attic"]
    assert others.token_changed("backbone/creator-far", False, 3.0)
    far, attic = others.absences()
    assert (far.name, far.since_s, attic.since_s) == ("far", 3.0, 1.0)
    assert "link" in far.cause
    assert far.remedy == f"type there: {command_on(FAR, mission(BASE, FAR, ATTIC))}"


def test_a_machine_is_lost_if_it_was_there_before() -> None:
    others = OtherHosts(mission(BASE, FAR, ATTIC), 0.0)
    assert others.lost == []
    others.token_changed("backbone/creator-far", True, 1.0)
    others.token_changed("backbone/creator-far", False, 2.0)
    assert others.lost == ["far"]
    others.token_changed("backbone/creator-far", True, 3.0)
    assert others.lost == []


def test_the_end_of_a_mission_waits_for_a_host_while_it_may_run_components_and_says_so() -> None:
    async def main() -> None:
        clock, changed, said = VirtualClock(), asyncio.Event(), list[str]()
        others = OtherHosts(mission(BASE, FAR, ATTIC), 0.0)
        saying = asyncio.create_task(announce_awaited_hosts(others, clock, changed, said.append))
        for at_s, stands in ((1.0, True), (2.0, False)):
            await clock.sleep_until_s(at_s)
            assert awaited_hosts(others, clock) == "", "what was never there runs nothing"
            others.token_changed("backbone/creator-far", stands, clock.now_s())
            changed.set()
        await clock.sleep_until_s(1.9 + CUT_OFF_ENDS_WITHIN_S)
        assert said == [awaited_hosts(others, clock)]
        assert "until what runs on far has ended" in said[0]
        await clock.sleep_until_s(2.0 + CUT_OFF_ENDS_WITHIN_S)
        assert awaited_hosts(others, clock) == ""
        await end_tasks(saying)

    run_virtual(main())


def test_a_machine_is_not_told_to_come_to_an_address_that_the_hub_has_lost() -> None:
    lost: list[str] = []
    others = OtherHosts(mission(BASE, FAR), 0.0, has_address=lambda host: host.address not in lost)
    assert "--connect tcp/192.0.2.1:7447" in others.absences()[0].remedy
    lost.append(BASE.address)
    [far] = others.absences()
    assert far.cause == "base does not have the address 192.0.2.1 any more"
    assert "write the new one into its file" in far.remedy
    others.token_changed("backbone/creator-far", True, 1.0)
    assert others.absences() == []


@pytest.mark.parametrize(
    ("where", "is_here"), [("127.0.0.1", True), ("192.0.2.1", False), ("::1", True), ("attic.example.org", True)]
)
def test_an_address_is_this_machines_if_it_can_be_used_here(where: str, is_here: bool) -> None:
    assert has_address(Host(name="base", address=where)) is is_here


def test_a_missing_machine_degrades_the_mission() -> None:
    others = OtherHosts(mission(BASE, FAR), 0.0)
    assert health({}, others.absences(), 100.0).word is HealthWord.DEGRADED


def test_the_commands_that_offer_machines_are_known_while_they_are_there() -> None:
    others = OtherHosts(mission(BASE, FAR), 0.0)
    assert not others.token_changed("backbone/offer-far", True, 1.0)
    assert not others.token_changed("backbone/offer-field", True, 1.0), "the file does not have this machine"
    assert others.offering == ["backbone/offer-far", "backbone/offer-field"]
    others.token_changed("backbone/offer-far", False, 2.0)
    others.token_changed("backbone/offer-field", False, 2.0)
    assert others.offering == []


@pytest.mark.parametrize("host", [FAR, ATTIC], ids=lambda host: host.name)
def test_the_command_line_understands_the_printed_command(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    command = command_on(host, mission(BASE, FAR, ATTIC))
    words = command.split()
    assert words[:2] == ["scout-backbone", "creator"]
    assert [words[i + 1] for i, word in enumerate(words) if word == "--tag"] == list(host.tags)
    monkeypatch.chdir("/")
    done = CliRunner().invoke(app, words[1:])  # there is no file 'secret' in /
    assert (done.exit_code, "run.secret" in done.output) == (4, True)


def test_of_a_mission_that_is_recorded_each_host_is_told_to_record_what_it_says() -> None:
    command = command_on(FAR, mission(BASE, FAR), Path("/data/night.mcap"))
    assert command.endswith("--record night-far.mcap")
    assert "--record" not in command_on(FAR, mission(BASE, FAR))
