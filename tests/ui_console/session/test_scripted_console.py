"""A script at the console: granted, suspended, refused, and how each ends."""

from __future__ import annotations

import errno
import json
from itertools import pairwise
from typing import Any

import pytest
from driven_console import console, grant_at_once
from fake_resource_pool import FakeArc, FakePlacer

from backbone.addresses import RC_MANAGER
from backbone.placer.messages import NoHost
from backbone.rc_manager.messages import AskWhy
from backbone.scheduling.views import Why
from backbone.wire import Envelope
from resource_pool.arc_client import NoSuchAction
from ui_console.model.script import read_script
from ui_console.session.scripted import TOLD_AFTER_S, ScriptDriver

SCRIPT = '{"at_s":0.5,"left_rad_s":4,"right_rad_s":4}\n{"at_s":3,"release":true}\n'


async def play(placer: FakePlacer, script: str, **options: Any) -> tuple[int, list[dict[str, Any]]]:
    lines: list[dict[str, Any]] = []
    driver = ScriptDriver(lambda line: lines.append(json.loads(line)), read_script(script), **options)
    driven = console(placer, driver.show, work=driver.drive, watches=False)
    await driven.run()
    return driver.exit_code(driven), lines


def test_the_example_script_is_granted_drives_and_releases(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        arcs: list[FakeArc] = []
        placer.on_arc = lambda arc: (arcs.append(arc), grant_at_once(arc))  # type: ignore[assignment, return-value]
        code, lines = await play(placer, SCRIPT)
        assert code == 0
        words = [line["event"] for line in lines]
        assert words == ["granted", *["applied"] * (len(words) - 2), "released"]
        assert lines[0]["epochs"] == {"scout1": 1, "grabber1": 1}
        granted_s = lines[0]["at_s"]
        driven = [line for line in lines if line["event"] == "applied"]
        assert driven[0]["at_s"] == pytest.approx(granted_s + 0.5, abs=0.01)
        assert driven[0]["values"] == {"left_rad_s": 4.0, "right_rad_s": 4.0}
        assert {line["epoch"] for line in driven} == {1}
        assert lines[-1]["at_s"] == pytest.approx(granted_s + 3.0, abs=0.01)
        gaps = [later["at_s"] - earlier["at_s"] for earlier, later in pairwise(driven)]
        assert max(gaps) <= 0.11

    placer_world(scene)


def test_a_script_hears_suspended_and_resumed_and_drives_on_under_the_new_epoch(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        async def interrupt(arc: FakeArc) -> None:
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            await arc.suspend("higher", "console-9", deadline_s=0.0)
            await placer.clock.sleep_s(0.5)
            await arc.grant()

        placer.on_arc = lambda arc: arc.bus.start(interrupt(arc))  # type: ignore[assignment, return-value]
        code, lines = await play(placer, SCRIPT)
        # a command that was under way at the switch is refused by the ARC; that is told and no failure
        assert {line["code"] for line in lines if line["event"] == "refused"} <= {"arc.swapped_out"}
        others = [line["event"] for line in lines if line["event"] not in ("applied", "refused")]
        assert others == ["granted", "suspended", "resumed", "released"]
        assert {line["epoch"] for line in lines if line["event"] == "applied"} == {1, 2}
        assert lines[[line["event"] for line in lines].index("suspended")]["by"] == "console-9"
        assert code == 0

    placer_world(scene)


def test_a_claim_refused_ends_with_five_and_says_why(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.refusals["video_drive"] = NoHost("no host has a radio")
        code, lines = await play(placer, SCRIPT)
        assert code == 5
        assert [line["event"] for line in lines] == ["refused"]
        assert lines[0]["code"] == "placer.no_host"
        assert lines[0]["remedy"]

    placer_world(scene)


def test_a_grant_that_does_not_come_in_time_ends_with_five_and_leaves_no_claim(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        code, lines = await play(placer, SCRIPT, within_s=2.0)
        assert code == 5
        assert [line["event"] for line in lines] == ["refused", "released"]
        assert not placer.arcs

    placer_world(scene)


def test_a_script_that_waits_for_its_grant_is_told_once_why(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        async def why(asked: Envelope[AskWhy]) -> Why:
            return Why(asked.body.name, "waiting", ["console-9 has the higher priority"], "9", [], -1.0, "")

        placer.bus.serve(RC_MANAGER, AskWhy, why)
        code, lines = await play(placer, SCRIPT, within_s=20.0)
        assert code == 5
        assert [line["event"] for line in lines] == ["why", "refused", "released"]
        assert lines[0]["why"]["lines"] == ["console-9 has the higher priority"]
        assert lines[0]["at_s"] == pytest.approx(TOLD_AFTER_S, abs=0.5)

    placer_world(scene)


def test_a_command_refused_for_good_is_told_and_ends_with_five(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        def refuse(arc: FakeArc) -> None:
            arc.refusal = NoSuchAction("this kind cannot jump")
            grant_at_once(arc)

        placer.on_arc = refuse
        code, lines = await play(placer, '{"at_s":0,"jump":true}')
        assert [line["event"] for line in lines] == ["granted", "refused", "released"]
        assert code == 5

    placer_world(scene)


def test_a_release_nobody_confirms_ends_with_four(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        async def vanish(arc: FakeArc) -> None:
            await arc.grant()
            await placer.clock.sleep_s(0.2)
            await placer.kill(arc.name)
            await placer.bus.close()

        tasks: list[Any] = []
        placer.on_arc = lambda arc: tasks.append(placer.creator.start(vanish(arc)))
        code, lines = await play(placer, '{"at_s":0.5,"release":true}')
        assert lines[-1] | {"at_s": 0} == {
            "event": "released",
            "at_s": 0,
            "reason": "the script is over",
            "confirmed": False,
            "wanted": True,
        }
        assert code == 4

    placer_world(scene)


def test_a_wrong_line_in_a_streamed_script_stops_it_there_and_gives_the_robot_back(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        lines: list[dict[str, Any]] = []
        driver = ScriptDriver(lambda line: lines.append(json.loads(line)))
        driven = console(placer, driver.show, work=driver.drive, watches=False)
        for line in ('{"at_s":0,"left_rad_s":1,"right_rad_s":1}', "nonsense", '{"at_s":9,"halt":true}', None):
            driver.feed(line)
        await driven.run()
        assert [line["event"] for line in lines] == ["granted", "applied", "refused", "released"]
        assert (lines[2]["code"], driver.exit_code(driven)) == ("script.line", 2)

    placer_world(scene)


def test_a_streamed_script_that_cannot_be_read_further_gives_the_robot_back(placer_world: Any) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.on_arc = grant_at_once
        lines: list[dict[str, Any]] = []
        driver = ScriptDriver(lambda line: lines.append(json.loads(line)))
        driven = console(placer, driver.show, work=driver.drive, watches=False)
        driver.feed('{"at_s":0,"left_rad_s":1,"right_rad_s":1}')
        driver.cut(OSError(errno.EIO, "Input/output error"))
        await driven.run()
        assert [line["event"] for line in lines] == ["granted", "applied", "refused", "released"]
        assert "Input/output error" in lines[2]["detail"]
        assert driver.exit_code(driven) == 2

    placer_world(scene)
