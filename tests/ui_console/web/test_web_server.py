"""Browsers on the loopback, real sockets and real time, before a placer and ARCs that decide nothing."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import urllib.error
import urllib.request
from collections.abc import Awaitable, Iterator

import pytest
from fake_resource_pool import FakeArc
from web_stage import ANYBODY, HEIGHT_PX, HIGH, LOW, RIGHTS, WIDTH_PX, WITHIN_S, Stage
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import CloseCode

from resource_pool.commands import Halt, Move
from ui_console.web import login, page_server
from ui_console.web.login import MAX_MESSAGE_BYTES, Authenticator
from ui_console.web.page_server import CannotListen
from ui_console.web.server import Console, WebServer


async def all_in_turn(sends: Iterator[Awaitable[None]]) -> None:
    for send in sends:
        await send


async def test_who_takes_a_robot_drives_it_and_who_lets_go_stops_it(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        assert anna.view["own"]["status"].startswith("you hold scout1")
        for _ in range(6):
            await anna.drive(forward=1.0, right=0.0, speed=0.5)
            await stage.clock.sleep_s(0.05)
        await anna.say(do="stop")
        await stage.placer.wait(lambda: stage.drives() and isinstance(stage.drives()[-1][1], Halt))
        assert stage.drives()[0][1] == Move(0.05, 0.0)
        await anna.say(do="release")
        await anna.wait(lambda: not anna.view["own"]["is_asked"], "given back")
        [arc] = stage.placer.arcs.values()
        assert (arc.is_idle, arc.granted) == (True, False), "it holds nothing and is there at once"
        await anna.say(do="take", robot="scout1")
        await stage.placer.wait(lambda: not arc.is_idle)
        await arc.grant()
        await anna.wait(lambda: anna.is_held, "held again")
        assert stage.placer.started == [arc.name]


async def test_when_nothing_is_heard_for_a_moment_the_wheels_stop_by_the_servers_clock(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        await anna.drive(forward=1.0, right=0.5, speed=0.5)
        await stage.placer.wait(lambda: any(isinstance(command, Halt) for _at, command in stage.drives()))
        count = len(stage.drives())
        await stage.clock.sleep_s(0.5)
        assert len(stage.drives()) == count, "one halt, then silence"


async def test_a_press_from_before_a_stop_moves_nothing_after_the_lift(stage: Stage) -> None:
    stage.grant_all()
    stage.place_robots("scout1")
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        pressed_at = anna.view["own"]["moment"]
        stage.robots["scout1"].stop("ben", "")
        await anna.wait(lambda: anna.view["own"]["stop"], "stopped")
        stage.robots["scout1"].free()
        await anna.wait(lambda: not anna.view["own"]["stop"], "free")
        count = len(stage.drives())
        await anna.say(do="drive", moment=pressed_at, forward=1.0, right=0.0, speed=0.5)
        await anna.say(do="give", moment=pressed_at, word="jump", values={}, role="")
        await anna.drive(forward=1.0, right=0.0, speed=0.25)
        await stage.placer.wait(lambda: len(stage.drives()) > count)
        assert stage.drives()[count][1] == Move(0.025, 0.0, after_stop=1), "it was pressed after the lift"


async def test_a_browser_that_vanishes_stops_its_wheels_and_gives_the_robot_back(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        [arc] = stage.placer.arcs.values()
        await anna.drive(forward=1.0, right=0.0, speed=0.5)
        await stage.placer.wait(lambda: arc.commands)
        anna.socket.transport.abort()
        await stage.placer.wait(lambda: arc.released)
        assert isinstance(arc.commands[-1][2], Halt)
        await stage.placer.wait(lambda: not stage.hub.clients)


@pytest.mark.parametrize("stop", [{"do": "stop_robot", "robot": "scout1"}, {"do": "stop_all"}], ids=["one", "all"])
async def test_an_emergency_stop_is_carried_out_although_its_page_vanishes(stage: Stage, stop: dict[str, str]) -> None:
    stage.place_robots("scout1")
    async with stage.browser() as anna:
        await anna.wait(lambda: anna.view["robots"], "known")
        await anna.say(**stop)
        anna.socket.transport.abort()
        await stage.placer.wait(lambda: not stage.hub.clients, WITHIN_S)
        await stage.placer.wait(lambda: stage.robots["scout1"].is_stopped, WITHIN_S)


async def test_who_loses_the_robot_is_told_who_took_it_and_why(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser(LOW) as ben:
        await ben.say(do="take", robot="scout1")
        await ben.wait(lambda: ben.is_held, "held")
        [arc] = stage.placer.arcs.values()
        assert arc.parameters["path"][0][1] == 50
        assert arc.name.startswith("ben-")
        await arc.suspend("higher priority", "anna-1", deadline_s=0.0)
        await ben.wait(lambda: not ben.is_held, "taken")
        assert ben.view["own"]["taken_because"] == "higher priority, because of anna-1"
        await arc.grant()
        await ben.wait(lambda: ben.is_held, "back")
        assert ben.view["own"]["taken_because"] == ""


async def test_two_operators_claim_one_robot_each_with_the_priority_of_their_token(stage: Stage) -> None:
    async with stage.browser(HIGH, priority=70) as anna, stage.browser(LOW, priority=1000) as ben:
        await anna.say(do="take", robot="scout1")
        await ben.say(do="take", robot="scout1")
        await stage.placer.wait(lambda: len(stage.placer.arcs) == 2)
        asked = {arc.name[:3]: arc.parameters["path"][0][1] for arc in stage.placer.arcs.values()}
        assert asked == {"ann": 70, "ben": 50}


async def test_who_waits_asks_with_one_button_and_who_holds_answers_with_one(stage: Stage) -> None:
    stage.answer_who_holds()
    async with stage.browser(HIGH) as anna, stage.browser(ANYBODY, user="Carla") as carla:
        await anna.say(do="take", robot="scout1")
        await stage.placer.wait(lambda: stage.placer.arcs)
        [held] = stage.placer.arcs.values()
        await held.grant()
        await anna.wait(lambda: anna.is_held, "held")
        await carla.say(do="take", robot="scout1")
        await stage.placer.wait(lambda: len(stage.placer.arcs) == 2)

        await carla.say(do="may_i", why="mine is stuck")
        await anna.wait(lambda: anna.view["own"]["consent"], "asked")
        shown = anna.view["own"]["consent"]
        assert (shown["user"], shown["robot"], shown["why"]) == ("Carla", "scout1", "mine is stuck")
        await anna.decide(is_given=False)
        await carla.wait(lambda: carla.view["own"]["asked"] == "anna keeps scout1", "declined")
        assert anna.is_held

        await carla.say(do="may_i")
        await anna.wait(lambda: anna.view["own"]["consent"], "asked again")
        await anna.decide(is_given=True)
        await carla.wait(lambda: carla.view["own"]["asked"] == "anna lets you have scout1", "granted")
        await anna.wait(lambda: not anna.is_held and not anna.view["own"]["consent"], "given back")
        assert held.is_idle
        told = [row.what for row in stage.hub.team.log() if row.subject == "scout1"]
        for line in ("anna keeps it: asked by Carla", "anna lets it go: asked by Carla"):
            assert told.count(line) == 1
        assert told[-1] == "was given back by anna: Carla may have it"


async def test_pictures_of_any_robot_that_somebody_holds_can_be_watched(stage: Stage) -> None:
    """Three robots, none of them this operator's; their behaviors' ARCs deliver the pictures."""
    robots = {f"scout{number}": f"watch{number}-capture" for number in (1, 2, 3)}
    arcs = {}
    for robot, name in robots.items():
        bus = stage.placer.network.join(f"resource_pool/{name}", stage.clock)
        arcs[robot] = FakeArc(bus, stage.clock, name, {"wish": {"robot": robot}, "owner": "mission_control/w"})
    try:
        async with stage.browser() as anna, stage.browser(LOW) as ben:
            stage.publish_schedule(**robots)
            await anna.wait(lambda: len(anna.view.get("robots", [])) == 3, "robots")
            await anna.say(do="watch", robots=[*robots, "scout9"])
            await ben.say(do="watch", robots=["scout2"])
            await stage.placer.wait(lambda: sum(len(one.outbox.watched) for one in stage.hub.clients) == 5)
            for number in range(40):
                for arc in arcs.values():
                    arc.publish(bytes([number]) * (WIDTH_PX * HEIGHT_PX), WIDTH_PX, HEIGHT_PX, number)
                await stage.clock.sleep_s(0.03)
            await anna.wait(lambda: all(len(anna.pictures.get(robot, [])) >= 30 for robot in robots), "pictures")
            assert all(numbers == sorted(set(numbers)) for numbers in anna.pictures.values())
            assert set(ben.pictures) == {"scout2"}
            assert stage.hub.pictures_packed <= 3 * 40, "packed once for all who watch"
            await anna.wait(lambda: len(anna.view["drawn"]) == 3, "the latency from lens to screen")
            await anna.say(do="watch", robots=[])
            await ben.say(do="watch", robots=[])
            await stage.placer.wait(lambda: not any(one.outbox.watched for one in stage.hub.clients))
            packed = stage.hub.pictures_packed
            arcs["scout2"].publish(bytes(WIDTH_PX * HEIGHT_PX), WIDTH_PX, HEIGHT_PX, 99)
            await stage.clock.sleep_s(0.1)
            assert stage.hub.pictures_packed == packed, "nobody watches, nothing is packed"
    finally:
        for arc in arcs.values():
            await arc.bus.close()


@pytest.mark.parametrize(
    ("first", "words"),
    [
        (b'{"do":"hello","token":"wrong"}', "showed a wrong token"),
        (b'{"do":"stop_all"}', "before it showed a token"),
        (b"x" * (MAX_MESSAGE_BYTES + 1), "more than 4096 bytes"),
        (b"\x00\x01", "means nothing"),
    ],
)
async def test_who_is_not_let_in_is_cut_off_and_the_operators_see_an_alarm(
    stage: Stage, first: bytes, words: str
) -> None:
    async with stage.browser() as anna:
        async with stage.connection() as stranger:
            await stranger.send(first)
            with pytest.raises(ConnectionClosed) as closed:
                async with asyncio.timeout(WITHIN_S):
                    await stranger.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code in (1007, 1008, 1009)
        await anna.wait(lambda: anna.has_alarm(words), words)
        # A process that waited for a processor sees no link for a moment.
        await anna.wait(lambda: anna.view["own"]["status"].startswith("watching"), "anna goes on watching")
        [key] = [alarm["key"] for alarm in anna.view["alarms"] if words in alarm["line"]]
        await anna.say(do="acknowledge", key=key)
        await anna.wait(lambda: not anna.has_alarm(words), "seen")


async def test_a_page_of_another_site_may_not_connect(stage: Stage) -> None:
    async with stage.browser() as anna:
        with pytest.raises(InvalidStatus, match="403"):
            async with stage.connection(origin="http://evil.example"):
                pytest.fail("was let in")
        await anna.wait(lambda: anna.has_alarm("another site"), "alarm")
        async with stage.connection(origin=f"http://127.0.0.1:{stage.port}"):
            pass


@pytest.mark.parametrize("header", ["Host", "Origin"])
async def test_a_connection_that_repeats_its_host_or_origin_is_refused_as_another_site(
    stage: Stage, header: str, capfd: pytest.CaptureFixture[str]
) -> None:
    own = f"http://127.0.0.1:{stage.port}"
    repeated = [("Origin", own), (header, own if header == "Origin" else "evil.example")]
    with pytest.raises(InvalidStatus, match="403"):
        async with stage.connection(additional_headers=repeated):
            pytest.fail("was let in")
    assert "Traceback" not in capfd.readouterr().err


async def test_others_do_not_notice_one_that_floods(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna, stage.connection() as flooder:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        await flooder.send(json.dumps({"do": "hello", "token": LOW}))
        flood = (flooder.send(b'{"do":"drive","moment":0,"forward":1,"right":0,"speed":0.5}') for _ in range(20_000))
        with contextlib.suppress(ConnectionClosed):
            await all_in_turn(flood)
        async with asyncio.timeout(WITHIN_S):
            await flooder.wait_closed()
        assert flooder.close_code == CloseCode.POLICY_VIOLATION
        await anna.wait(lambda: anna.has_alarm("ben at 127.0.0.1 sent more than"), "alarm")
        await anna.drive(forward=1.0, right=0.0, speed=0.25)
        await stage.placer.wait(lambda: any(command == Move(0.025, 0.0) for _at, command in stage.drives()))


@pytest.mark.thorough
async def test_others_do_not_notice_one_that_stops_reading(stage: Stage) -> None:
    """It is found out by the pings it does not answer; its robot is given back."""
    stage.grant_all()
    async with stage.browser() as anna:
        deaf = socket.create_connection(("127.0.0.1", stage.port))
        try:
            request = (
                f"GET /socket HTTP/1.1\r\nHost: 127.0.0.1:{stage.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
            )
            deaf.sendall(request.encode())
            for said in ({"do": "hello", "token": LOW}, {"do": "take", "robot": "scout2"}):
                body = json.dumps(said).encode()
                deaf.sendall(bytes([0x81, 0x80 | len(body)]) + bytes(4) + body)  # masked with zeros
            await stage.placer.wait(lambda: len(stage.hub.clients) == 2)
            await anna.wait(lambda: anna.has_alarm("ben at 127.0.0.1 has read nothing"), "alarm")
            await stage.placer.wait(lambda: len(stage.hub.clients) == 1)
            await stage.placer.wait(lambda: not stage.placer.arcs)
        finally:
            deaf.close()
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")


async def test_who_says_nothing_at_all_is_let_go(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    async with stage.browser() as anna:
        monkeypatch.setattr(login, "LOGIN_WITHIN_S", 0.2)
        async with stage.connection() as silent:
            with pytest.raises(ConnectionClosed):
                async with asyncio.timeout(WITHIN_S):
                    await silent.recv()
        await anna.wait(lambda: anna.has_alarm("showed no token within"), "alarm")


async def test_only_so_many_operators_are_served_and_the_next_is_told_so(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with stage.browser() as anna, stage.connection() as ben:
        monkeypatch.setattr(page_server, "MOST_OPERATORS", 1)
        await ben.send(json.dumps({"do": "hello", "token": LOW}))
        with pytest.raises(ConnectionClosed, match="found 1 client there"):
            async with asyncio.timeout(WITHIN_S):
                await ben.recv()
        await anna.wait(lambda: anna.has_alarm("ben found 1 client there"), "alarm")


@pytest.mark.parametrize("host", ["127.0.0.1", "192.168..1"], ids=["its port is taken", "no name of a host"])
async def test_an_address_that_cannot_be_had_is_refused_with_a_remedy(stage: Stage, host: str) -> None:
    with pytest.raises(CannotListen, match=str(stage.port)) as refused:
        await WebServer(Console(stage.hub, Authenticator(RIGHTS))).run(host, stage.port, lambda port: None)
    assert "--port" in refused.value.remedy


async def test_the_page_is_served_with_its_policy_and_nothing_else_is(stage: Stage) -> None:
    def get(path: str) -> tuple[int, str]:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{stage.port}{path}", timeout=WITHIN_S) as answer:
                return answer.status, answer.headers["Content-Security-Policy"]
        except urllib.error.HTTPError as error:
            error.close()
            return error.code, error.headers["Content-Security-Policy"]

    status, policy = await asyncio.to_thread(get, "/")
    assert (status, "default-src 'none'" in policy) == (200, True)
    status, policy = await asyncio.to_thread(get, "/etc/passwd")
    assert (status, "default-src 'none'" in policy) == (404, True)


async def test_what_cannot_be_stopped_for_certain_is_said(stage: Stage) -> None:
    async with stage.browser() as anna:
        stage.publish_schedule(scout1="")
        await anna.wait(lambda: anna.view.get("robots"), "robots")
        await anna.say(do="stop_robot", robot="scout1")
        await anna.wait(lambda: anna.answers, "answer")
        assert anna.answers == [{"refused": "not certain to have stopped: scout1"}]


async def test_why_is_answered(stage: Stage) -> None:
    async with stage.browser() as anna:
        await anna.say(do="why", name="nobody")
        await anna.wait(lambda: anna.answers, "answer")
        assert anna.answers[0]["why"] == "nobody"
        assert anna.answers[0]["lines"]


async def test_the_recording_says_who_came_and_who_left(stage: Stage) -> None:
    async with stage.browser(ANYBODY, user="Carla"):
        pass
    await stage.placer.wait(lambda: not stage.hub.clients)
    await stage.placer.wait(lambda: any("Carla left" in row.what for row in stage.hub.team.log()))
    told = [row.what for row in stage.hub.team.log() if row.subject == "web"]
    assert told == ["Carla sat down: with priority 10", "Carla left: the browser has gone away"]


async def test_when_the_page_is_no_longer_in_front_the_wheels_stop_and_alarms_are_kept_for_later(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        await anna.drive(forward=1.0, right=0.0, speed=0.5)
        await stage.placer.wait(stage.drives)
        await anna.say(do="here", is_there=False)
        await stage.placer.wait(lambda: any(isinstance(command, Halt) for _at, command in stage.drives()))
        await anna.wait(lambda: anna.view["own"]["away_since_s"] >= 0, "away")
        async with stage.browser(LOW) as ben:
            await ben.wait(lambda: ben.view["own"]["away_since_s"] < 0, "somebody is there again")


async def test_parameters_of_a_component_are_told_and_changed(stage: Stage) -> None:
    async with stage.browser() as anna:
        await anna.say(do="parameters", name="nobody")
        await anna.wait(lambda: anna.answers, "answer")
        assert anna.answers.pop() == {"parameters": "nobody", "told": False}
        await anna.say(do="set", name="nobody", parameter="threshold", value=[1, 2])
        await anna.wait(lambda: anna.answers, "answer")
        assert anna.answers.pop() == {"set": "nobody", "parameter": "threshold", "done": False}
        await anna.wait(lambda: anna.has_alarm("nobody"), "why not")
