"""Commands are data: any kind of ARC passes those it declares on to the RC of their role, under the epoch."""

from __future__ import annotations

import re
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pool_on_local_network import TwoLampsArc, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.abilities import UNLIMITED, ValueKind, unit_of
from backbone.component.field_docs import first_sentence
from backbone.wire import Message, UnknownMessage
from resource_pool.arcs.drive import DriveArc
from resource_pool.commands import Command, Drive, Halt, Jump, Move, SwitchTransmitter, WrongCommand, command_of
from resource_pool.messages import COMMAND_TIMEOUT_S, NoSuchAction, SwappedOut
from resource_pool.rcs.scout import MOST_M_S, Scout
from resource_pool.rcs.skeleton import Lamp, Shine
from scout_model.scout import wheels_rad_s

KINDS = (Move, Drive, Halt, Jump, SwitchTransmitter, Shine)
commands = st.one_of(
    st.builds(Move, st.floats(-100, 100), st.floats(-1000, 1000)),
    st.builds(Drive, st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    st.builds(Halt),
    st.builds(Jump),
    st.builds(SwitchTransmitter, st.booleans(), st.text(max_size=20)),
    st.builds(Shine, st.floats(0, 1)),
)


def test_no_description_for_people_names_a_constant_of_the_code() -> None:
    """``components --type scout`` prints the first sentences; a person cannot look 'COMMAND_TIMEOUT_S' up."""
    sentences = {kind: first_sentence(kind) for kind in KINDS}
    assert [one for one in sentences.values() if re.search(r"[A-Z]{2}", one)] == []
    for kind in (Move, Drive):
        assert sentences[kind].endswith(f"until another command, at most for {COMMAND_TIMEOUT_S:g} s")


@given(commands, st.text(max_size=8), st.integers(0, 9))
def test_a_command_by_its_values_is_the_command_itself(command: Command, role: str, stop: int) -> None:
    values = {
        name: getattr(command, name) for name in type(command).__match_args__ if name not in Command.__struct_fields__
    }
    expected = msgspec.structs.replace(command, role=role, after_stop=stop)
    assert command_of(type(command), values, role=role, after_stop=stop) == expected


@pytest.mark.parametrize(
    ("kind", "values", "told"),
    [
        (Move, {"forwards": 1.0}, "move has no field forwards; its fields: forward_m_s, turn_rad_s"),
        (Move, {"turn_rad_s": 1.0}, "move needs a value of forward_m_s"),
        (Move, {"forward_m_s": "quick"}, "Expected `float`, got `str`, in forward_m_s"),
        (Move, {"forward_m_s": float("nan")}, "Expected `float`"),
        (Shine, {"brightness": 1.5}, "<= 1.0, in brightness"),
        (Halt, {"epoch": 3}, "halt has no field epoch; its fields: none"),
        (Halt, {"arc": "other"}, "halt has no field arc"),
    ],
)
def test_values_that_do_not_fit_are_refused(kind: type[Command], values: dict[str, object], told: str) -> None:
    with pytest.raises(WrongCommand, match=told):
        command_of(kind, values, role="", after_stop=0)


@given(commands, st.text(max_size=9), st.integers(0, 2**53))
def test_only_arc_and_epoch_change_on_the_way_to_the_rc(command: Command, arc: str, epoch: int) -> None:
    sent = command.under(arc, epoch)
    assert (sent.arc, sent.epoch) == (arc, epoch)
    assert sent.under(command.arc, command.epoch) == command


def test_the_forms_of_a_scout_have_units_and_the_limits_of_its_motors() -> None:
    abilities = Scout.abilities()
    forms = {form.word: form for form in abilities.commands}
    assert list(forms) == ["move", "drive", "halt", "jump", "switch_transmitter"]
    forward, turn = forms["move"].fields
    assert (forward.kind, forward.unit, forward.least, forward.most) == (ValueKind.NUMBER, "m/s", -MOST_M_S, MOST_M_S)
    assert (turn.unit, turn.is_required, turn.default) == ("rad/s", False, 0.0)
    assert [word for word, form in forms.items() if form.moves] == ["move", "drive", "jump"]
    assert abilities.is_robot
    assert forms["halt"].doc == "Stop the wheels"


def test_an_arc_says_which_roles_obey_its_commands() -> None:
    assert [(form.word, form.roles) for form in DriveArc.abilities().commands] == [
        (word, ["scout"]) for word in ("move", "drive", "halt", "jump")
    ]
    assert {form.word: form.roles for form in TwoLampsArc.abilities().commands}["shine"] == ["left", "right"]
    assert DriveArc.abilities().body == "scout"


def test_the_form_of_a_devices_command_has_the_range_of_its_field() -> None:
    [shine] = Lamp.abilities().commands
    [brightness] = shine.fields
    assert (brightness.name, brightness.unit, brightness.least, brightness.most) == ("brightness", "", 0.0, 1.0)
    assert not Lamp.abilities().is_robot


@given(st.sampled_from(KINDS))
def test_no_form_offers_what_the_arc_fills_in(kind: type[Command]) -> None:
    for abilities in (Scout.abilities(), Lamp.abilities(), DriveArc.abilities(), TwoLampsArc.abilities()):
        for form in abilities.commands:
            assert not {field.name for field in form.fields} & {"arc", "epoch", "after_stop", "role"}
            assert all(-UNLIMITED <= field.least <= field.most <= UNLIMITED for field in form.fields)
    assert issubclass(kind, Message)


def test_a_unit_is_the_longest_that_a_name_ends_with() -> None:
    assert [unit_of(name) for name in ("speed_m_s", "turn_rad_s", "after_s", "tilt_rad", "turns")] == [
        "m/s",
        "rad/s",
        "s",
        "rad",
        "",
    ]


def test_a_scout_moves_by_meters_and_radians(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "drive", "scout1")
            await arc.wait_granted()
            left, right = wheels_rad_s(0.1, 0.5)
            assert (await arc.move(0.1, 0.5)).values == {"left_rad_s": left, "right_rad_s": right}
            assert (await arc.give("move", {"forward_m_s": 0.1, "turn_rad_s": 0.5})).values == {
                "left_rad_s": left,
                "right_rad_s": right,
            }
            assert (await arc.move(50.0)).values == {"left_rad_s": 17.5, "right_rad_s": 17.5}

    run_virtual(scene())


def test_a_command_of_a_device_passes_by_class_and_by_word(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "lit_drive", "scout1")
            await arc.wait_granted()
            assert (await arc.command(Shine(0.25))).values == {"brightness": 0.25}
            applied = await arc.give("shine", {"brightness": 0.5})
            assert (applied.rc, applied.command, applied.values) == ("lamp1", "shine", {"brightness": 0.5})
            with pytest.raises(WrongCommand):
                await arc.give("shine", {"brightness": 2.0})
            with pytest.raises(NoSuchAction, match="no command blink; it has: move, drive, halt, jump, shine"):
                await arc.give("blink", {})
            with pytest.raises(NoSuchAction, match="no command switch_transmitter"):
                await arc.command(SwitchTransmitter(True, "video"))

    run_virtual(scene())


def test_a_command_that_an_rc_declares_and_does_not_obey_is_refused_with_the_name_of_its_class(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "lit_drive", "scout1")
            await arc.wait_granted()
            monkeypatch.delattr(Lamp, "obey")
            with pytest.raises(UnknownMessage, match="lamp1 declares shine and does not obey it") as refused:
                await arc.command(Shine(0.25))
            assert "Lamp.obey" in refused.value.remedy

    run_virtual(scene())


def test_a_command_that_two_rcs_obey_names_one_of_them(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1", "lamp2"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "two_lamps", "scout1")
            granted = await arc.wait_granted()
            assert {granted.rcs["left"], granted.rcs["right"]} == {"lamp1", "lamp2"}
            assert granted.robot == "scout1"
            applied = await arc.command(Shine(0.5, role="right"))
            assert applied.rc == granted.rcs["right"]
            assert (await arc.give("shine", {"brightness": 0.5}, role="left")).rc == granted.rcs["left"]
            for wrong in (Shine(0.5), Shine(0.5, role="middle"), Shine(0.5, role="scout")):
                with pytest.raises(NoSuchAction) as refused:
                    await arc.command(wrong)
                assert "left, right" in refused.value.remedy

    run_virtual(scene())


def test_without_a_grant_no_command_of_any_kind_passes(local_mission: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["scout1", "radio", "lamp1"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "lit_drive", "scout1")
            await arc.wait_granted()
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            for refused in (arc.command(Shine(1.0)), arc.move(0.1), arc.give("shine", {"brightness": 1.0})):
                with pytest.raises(SwappedOut):
                    await refused

    run_virtual(scene())
