"""``components`` and ``resources``: what is there, what it can do, who has it, and how busy it is."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
from typer.testing import CliRunner

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line import inventory
from backbone.command_line.cli import app
from backbone.command_line.inventory import print_resources, print_types
from backbone.command_line.where import Where
from backbone.component.abilities import Abilities, CommandForm, FieldForm, ValueKind
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType, Multiplicity, UnknownType
from backbone.component_database.service import ComponentDatabase
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule, AskUtilization
from backbone.scheduling.requests import Holder, RequestState, UnknownRc
from backbone.scheduling.views import Period, RcUtilization, RcView, RequestView, Schedule, Utilization
from backbone.wire import Envelope, Message

WHERE = Where("local", None, None)
SPEED = FieldForm("forward_m_s", ValueKind.NUMBER, "m/s", -0.3, 0.3, is_required=True, doc="Along its heading.")
MOVE = CommandForm("move", [SPEED], moves=True, doc="Move forward and turn.")
BATTERY = FieldForm("battery_v", ValueKind.NUMBER, "V", 0.0, 12.0, doc="Voltage of its battery.")
TYPES = [
    ComponentType("scout", "x:Scout", Subsystem.RESOURCE_POOL, abilities=Abilities(commands=[MOVE], reports=[BATTERY])),
    ComponentType("two_eyed", "x:Eyes", Subsystem.RESOURCE_POOL, needs={"scout": "scout", "left_eye": "camera"}),
    ComponentType("world", "x:World", Subsystem.RESOURCE_POOL, Multiplicity.ONE),
    ComponentType("rc_manager", "x:Y", Subsystem.BACKBONE, Multiplicity.ONE, core=True),
]
CONSOLE = "ui_console/console-7"
SCHEDULE = Schedule(
    100.0,
    [
        RcView("scout1", "scout", "up", False, 1.0, [Holder("console-7-drive", 3, 90.0, 102.0)], 3, []),
        RcView("radio", "command_radio", "down", True, 0.5, [], 0, []),
    ],
    [RequestView("console-7-drive", CONSOLE, RequestState.RUNNING, ["scout1"], 90.0, -1.0, -1.0, "", [], 5.0, "", 1)],
    [],
)
PERIODS = [
    Period(60.0, 90.0, "watch1-drive asks", {"watch1-drive": 1.0}),
    Period(90.0, -1.0, "console-7-drive asks", {"console-7-drive": 0.9, "watch1-drive": 0.1}),
]
USED = {"scout1": (0.5, 0.25, PERIODS), "radio": (0.0, 0.0, [])}


class Plain(Component[Any]):
    """A component without questions of its own."""


class Console(Component[Any]):
    """A console with a person at it."""

    def person(self) -> str:
        return "anna"


class PlainRcManager(Component[Any]):
    """Answers with a fixed schedule."""

    accepts = AskSchedule | AskUtilization

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case AskSchedule():
                return SCHEDULE
            case AskUtilization(periods=periods):
                rcs = [RcUtilization(rc, 40.0, one, ten, of if periods else []) for rc, (one, ten, of) in USED.items()]
                return Utilization(100.0, rcs)
        return await super().answer(asked)


@asynccontextmanager
async def a_mission(local_mission: Any, beside: Any) -> AsyncIterator[LocalNetwork]:
    clock = VirtualClock()
    types = [msgspec.to_builtins(one) for one in TYPES]

    def begun(kind: type[Component[Any]], at: str, type_: str, parameters: dict[str, Any] | None = None) -> Any:
        subsystem, _, name = at.partition("/")
        launch = Launch("local", Subsystem(subsystem), name, type_, "x:Y", "field", "", 0.0, 1.0, parameters or {})
        return beside(kind(launch, network.join(at, clock), clock))

    async with (
        local_mission() as network,
        begun(ComponentDatabase, "backbone/component_database", "component_database", {"types": types}),
        begun(PlainRcManager, "backbone/rc_manager", "rc_manager"),
        begun(Plain, "resource_pool/scout1", "scout"),
        begun(Console, CONSOLE, "console"),
    ):
        yield network


@pytest.fixture
def told(
    local_mission: Any, beside: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Callable[[], Any]], tuple[str, str]]:
    """Run a command on the local bus of a mission at 100 s; return what it prints and says."""

    def run(command: Callable[[], Any]) -> tuple[str, str]:
        async def main() -> None:
            async with a_mission(local_mission, beside) as network:
                clock = VirtualClock()
                await clock.sleep_until_s(100.0)

                @asynccontextmanager
                async def connected(_where: Where) -> AsyncIterator[tuple[Any, VirtualClock]]:
                    yield network.join("ui_console/cli-1", clock), clock

                monkeypatch.setattr(inventory, "connected", connected)
                assert await command() == 0

        run_virtual(main())
        return tuple(capsys.readouterr())

    return run


def rows(printed: str, *, of: int = 0) -> list[list[str]]:
    """Return the cells of one of the printed tables, without its head."""
    tables = printed.split("└")[of].rsplit("├", maxsplit=1)[-1]
    return [[cell.strip() for cell in line.split("│")[1:-1]] for line in tables.splitlines() if "│" in line]


def test_components_shows_each_type_its_limits_and_how_many_run(told: Any) -> None:
    printed, _ = told(lambda: print_types(WHERE, "", as_json=False, width=150))
    assert rows(printed) == [
        ["rc_manager", "backbone", "1", "1", "", "x:Y"],
        ["scout", "resource_pool", "any number", "1", "", "x:Scout"],
        ["two_eyed", "resource_pool", "any number", "0", "scout, camera as left_eye", "x:Eyes"],
        ["world", "resource_pool", "1", "0", "", "x:World"],
    ]


def test_one_type_shows_its_commands_and_reports_with_units_and_ranges(told: Any) -> None:
    printed, _ = told(lambda: print_types(WHERE, "scout", as_json=False, width=150))
    assert rows(printed, of=1) == [
        ["move", "", "", "", "", "", "Move forward and turn."],
        ["", "forward_m_s", "number", "m/s", "-0.3 to 0.3", "needed", "Along its heading."],
    ]
    assert rows(printed, of=2) == [["battery_v", "number", "V", "0 to 12", "Voltage of its battery."]]
    plain, _ = told(lambda: print_types(WHERE, "world", as_json=False, width=150))
    assert plain.splitlines()[-2:] == ["it obeys no commands", "it reports nothing"]


def test_components_as_json_has_all_of_it(told: Any) -> None:
    found = json.loads(told(lambda: print_types(WHERE, "", as_json=True, width=None))[0])
    assert found["mission"] == "local"
    [scout] = [one for one in found["types"] if one["name"] == "scout"]
    assert (scout["class"], scout["multiplicity"], scout["running"], scout["core"]) == ("x:Scout", "many", 1, False)
    assert scout["abilities"]["commands"][0]["fields"][0]["most"] == 0.3


def test_a_type_that_is_none_is_refused_with_its_likeliest_spelling(told: Any) -> None:
    with pytest.raises(UnknownType, match="scout"):
        told(lambda: print_types(WHERE, "scuot", as_json=False, width=None))


def test_resources_shows_host_holder_and_utilization(told: Any) -> None:
    printed, said = told(lambda: print_resources(WHERE, "", changes=False, as_json=False, width=150))
    assert rows(printed) == [
        ["scout1", "scout", "field", "up", "one ARC", "50.0%", "25.0%", "anna"],
        ["radio", "command_radio", "–", "down", "50%", "0.0%", "0.0%", "–"],
    ]
    assert "shares before" not in printed
    assert said == "utilization is counted for 60 seconds so far\n"


def test_with_changes_it_shows_the_shares_before_and_after_each_re_planning(told: Any) -> None:
    printed, _ = told(lambda: print_resources(WHERE, "scout1", changes=True, as_json=False, width=150))
    assert len(rows(printed)) == 1
    assert rows(printed, of=1) == [
        ["scout1", "60.0 s", "30.0 s", "watch1-drive asks", "watch1-drive 100.0%"],
        ["", "90.0 s", "10.0 s", "anna asks", "anna 90.0%, watch1-drive 10.0%"],
    ]


def test_resources_as_json_keeps_the_names_of_components(told: Any) -> None:
    command = lambda: print_resources(WHERE, "scout1", changes=True, as_json=True, width=None)  # noqa: E731
    [found] = json.loads(told(command)[0])["resources"]
    assert found["holders"] == [{"arc": "console-7-drive", "owner": CONSOLE, "person": "anna"}]
    assert (found["utilization_1_min"], found["utilization_10_min"], found["counted_since_s"]) == (0.5, 0.25, 40.0)
    assert [period["shares"] for period in found["periods"]] == [period.shares for period in PERIODS]


def test_a_resource_that_is_none_is_refused_with_its_likeliest_spelling(told: Any) -> None:
    with pytest.raises(UnknownRc, match="scout1"):
        told(lambda: print_resources(WHERE, "scuot1", changes=False, as_json=False, width=None))


@pytest.mark.parametrize("words", [["components"], ["components", "--type", "scout"], ["resources", "--json"]])
def test_without_a_mission_they_refuse_with_the_remedy(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.stdout) == (4, "")
    assert "no mission is up" in done.stderr
    assert "scout-backbone up" in done.stderr
