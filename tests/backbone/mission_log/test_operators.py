"""Every action of a person is one line with that person's name."""

from __future__ import annotations

import os

import msgspec
import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction, login_name, publish_action


@pytest.mark.parametrize("action", OperatorAction)
def test_every_action_has_a_sentence_that_names_the_user(action: OperatorAction) -> None:
    plain = OperatorActed("anna", action, "scout1", "", 1.0).sentence
    assert "anna" in plain
    assert OperatorActed("anna", action, "scout1", "because", 1.0).sentence == f"{plain}: because"


@pytest.mark.parametrize(("name", "known"), [("x" * 300, "x" * 255), (os.fsdecode(b"\xff"), r"\udcff"), ("ä", "ä")])
def test_a_login_name_fits_in_every_message(monkeypatch: pytest.MonkeyPatch, name: str, known: str) -> None:
    monkeypatch.setenv("LOGNAME", name)
    acted = OperatorActed(login_name(), OperatorAction.SET_PARAMETER, "scout1", "", 1.0)
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(acted), type=OperatorActed).user == known


def test_what_a_command_did_is_published_once_by_who_is_logged_in() -> None:
    async def main() -> list[OperatorActed]:
        network, clock = LocalNetwork("iros2001"), VirtualClock()
        command, recorder = network.join("ui_console/cli-1", clock), network.join("ui_console/recorder", clock)
        heard: list[OperatorActed] = []
        recorder.subscribe("*/*", Conversation.OPERATORS, OperatorActed, lambda said: heard.append(said.body))
        publish_action(command, clock, OperatorAction.STOP_COMPONENT, "scout1", "ended by asking")
        await clock.sleep_s(1.0)
        await command.close()
        await recorder.close()
        return heard

    [act] = run_virtual(main())
    assert (act.user, act.subject, act.detail, act.at_s) == (login_name(), "scout1", "ended by asking", 0.0)
