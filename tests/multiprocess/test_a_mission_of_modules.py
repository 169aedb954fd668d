"""The same two modules in one unit, in two units of one process, and in two processes: only the file is another."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from examples import rest_thorough
from running_mission import RunningMission, mission_up

from backbone.component.messages import AskStatistics, Statistics
from backbone.debug_views import ListViews, Views
from backbone.keys import Conversation

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

WITHIN_S = 20.0
UNDISTURBED_S = 3.0
REPLACED_WITHIN_S = 8.0  # a hub that hangs is replaced after 3 s
TESTER = "ui_console/tester"
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
FIRST = '<module name="first" class="pair:Smoothing"/>'
SECOND = """<module name="second" class="pair:Smoothing">
  <parameter name="weight" value="0.5"/>
  <input name="wave" key="smooth"/>
  <output name="smooth" key="smoother"/>
</module>"""
ARRANGEMENTS = {
    "one unit": f'<unit name="late">{SECOND}{FIRST}</unit>',
    "two units": f'<unit name="late" process="p">{SECOND}</unit><unit name="early" process="p">{FIRST}</unit>',
    "two processes": f'<unit name="late">{SECOND}</unit><unit name="early">{FIRST}</unit>',
}
MISSION = f"""<mission name="m" priority="1"><modules>
<given key="wave" class="pair:Height" address="{TESTER}" conversation="events"/>
{{units}}
</modules></mission>"""


@pytest.fixture(autouse=True, scope="module")
def _the_pair_can_be_imported() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(EXAMPLES))
        patch.syspath_prepend(EXAMPLES)
        yield


@pytest.fixture(scope="module")
def example(_the_pair_can_be_imported: None) -> Iterator[RunningMission]:
    """The example's mission, for tests that only look at it."""
    with mission_up(mission_xml=EXAMPLES / "pair.xml") as running:
        yield running


@pytest.mark.parametrize("units", rest_thorough(reversed(ARRANGEMENTS.values())), ids=reversed(ARRANGEMENTS))
async def test_an_arrangement_says_what_the_modules_say_by_hand(units: str, tmp_path: Path) -> None:
    import pair

    file = tmp_path / "m.xml"
    file.write_text(MISSION.format(units=units))
    waves = [pair.Height(float(number * number % 7)) for number in range(40)]
    heard: asyncio.Queue[pair.Height] = asyncio.Queue()
    said: list[pair.Height] = []
    with mission_up(mission_xml=file) as mission:
        async with mission.bus(TESTER) as bus:
            at = "mission_control/late/smoother"
            bus.subscribe(at, Conversation.OUTPUTS, pair.Height, lambda one: heard.put_nowait(one.body))
            for wave in waves:
                bus.publish(TESTER, Conversation.EVENTS, wave)
                async with asyncio.timeout(WITHIN_S):
                    said.append(await heard.get())
            told = (await bus.ask("mission_control/late", AskStatistics(), Statistics, within_s=WITHIN_S)).values
            assert told["second_runs"] == len(waves)
        pids = {one["pid"] for one in mission.status()["components"] if one["name"] in ("early", "late")}
        assert len(pids) == (2 if units is ARRANGEMENTS["two processes"] else 1)
    first, then = pair.Smoothing(), pair.Smoothing(pair.Smoothing.Parameters(weight=0.5))
    expected = [then.update(then.Inputs(first.update(first.Inputs(wave)).smooth)).smooth for wave in waves]
    assert msgspec.msgpack.encode(said) == msgspec.msgpack.encode(expected)


def test_load_shows_the_processor_time_of_modules_and_processes(example: RunningMission) -> None:
    done = example.command("scout-backbone", "load", "--json", "--mission", example.name)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {one["module"] for one in told["modules"]} == {"wave", "smoothing"}
    assert all(one["unit"] == "waves" and one["rate_hz"] > 1.0 for one in told["modules"])
    processes = {name: one for one in told["processes"] for name in one["components"]}
    assert processes["waves"]["pid"] == example.component("waves")["pid"]
    assert processes["launcher"]["processor_s"] > processes["waves"]["processor_s"] > 0.0
    drawn = example.command("scout-backbone", "load", "--for", "0.1", "--mission", example.name)
    assert "smoothing" in drawn.stdout


async def test_the_example_goes_into_a_mission_unchanged(example: RunningMission) -> None:
    async with example.bus(TESTER) as bus:
        import pair

        heard: asyncio.Queue[pair.Height] = asyncio.Queue()
        at = "mission_control/waves/smooth"
        bus.subscribe(at, Conversation.OUTPUTS, pair.Height, lambda one: heard.put_nowait(one.body))
        async with asyncio.timeout(WITHIN_S):
            for _ in range(5):
                await heard.get()
        told = (await bus.ask("mission_control/waves", AskStatistics(), Statistics, within_s=WITHIN_S)).values
        assert told["wave_runs"] == told["smoothing_runs"] >= 5
        assert (await bus.ask("mission_control/waves", ListViews(), Views, within_s=WITHIN_S)).views == []
    done = example.command("scout-backbone", "check", str(EXAMPLES / "pair.xml"), "--dry-run", "--for", "1")
    assert done.returncode == 0, done.stderr
    assert "waves" in done.stdout
    tree = example.command("scout-backbone", "tree", "--json", "--mission", example.name)
    assert json.loads(tree.stdout)["tree"] == []


def test_messages_that_a_module_declares_are_shown_with_the_names_of_their_fields(
    example: RunningMission, tmp_path: Path
) -> None:
    which = ["--mission", example.name]
    watched = example.command("scout-backbone", "watch", "*/waves/*", "--most", "1", "--for", "20", *which)
    assert '"height_m":' in watched.stdout, watched.stderr
    file = str(tmp_path / "waves.mcap")
    example.command("scout-backbone", "record", "--to", file, "--for", "1", *which)
    printed = example.command("scout-backbone", "recording", "print", file, "--keys", "*/outputs", "--most", "1")
    assert '"height_m":' in printed.stdout, printed.stderr


@pytest.mark.thorough
@pytest.mark.alone
@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
async def test_a_unit_goes_on_in_its_process_while_the_hub_of_its_mission_is_replaced(how: signal.Signals) -> None:
    async def statistics() -> dict[str, float]:
        async with mission.bus(TESTER) as bus:
            return (await bus.ask("mission_control/waves", AskStatistics(), Statistics, within_s=WITHIN_S)).values

    async def rate_hz(seconds: float, meanwhile: Callable[[], None] = lambda: None) -> float:
        """Return the rate of the unit's rounds in these seconds, at whose begin something is done."""
        began_s, before = time.monotonic(), (await statistics())["rounds"]
        meanwhile()
        await asyncio.sleep(seconds)
        return ((await statistics())["rounds"] - before) / (time.monotonic() - began_s)

    with mission_up(mission_xml=EXAMPLES / "pair.xml") as mission:
        hub, unit = mission.component("nameserver")["pid"], mission.component("waves")["pid"]
        undisturbed_hz = await rate_hz(UNDISTURBED_S)  # 20 Hz, or what this machine allows
        assert undisturbed_hz > 2.0
        assert await rate_hz(REPLACED_WITHIN_S, lambda: os.kill(hub, how)) > 0.8 * undisturbed_hz
        assert mission.component("nameserver")["pid"] != hub
        assert mission.component("waves")["pid"] == unit
