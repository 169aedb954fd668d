"""Which RC of an ARC's set obeys a command."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.arc_commands import ArcCommands
from resource_pool.commands import Command, Drive, Halt, Jump, WrongCommand
from resource_pool.messages import GiveCommand, NoSuchAction

roles = st.lists(st.sampled_from(["left", "right", "lamp"]), min_size=1, unique=True)


@given(roles, st.sampled_from(["", "left", "right", "lamp", "none"]))
def test_a_command_goes_to_the_role_it_names_or_to_the_only_one(able: Sequence[str], named: str) -> None:
    commands = ArcCommands("pair", {Halt: able}, ["left", "right", "lamp"], "")
    if named in able or (not named and len(able) == 1):
        assert commands.role_of(Halt(role=named)) == (named or able[0])
    else:
        with pytest.raises(NoSuchAction, match="halt") as refused:
            commands.role_of(Halt(role=named))
        assert all(role in refused.value.remedy for role in able)


@pytest.mark.parametrize("kind", [Drive, Halt, Jump])
def test_a_command_by_its_word_is_the_command(kind: type[Command]) -> None:
    commands = ArcCommands("drive", {Drive: "scout", Halt: "scout", Jump: ["scout"]}, ["scout"], "scout")
    values = {"left_rad_s": 1.0, "right_rad_s": 2.0} if kind is Drive else {}
    found = commands.by_word(GiveCommand(kind.word(), values, role="scout", after_stop=3))
    assert found == kind(**values, role="scout", after_stop=3)
    assert commands.role_of(found) == "scout"


def test_a_word_without_a_command_and_values_that_are_none_are_refused() -> None:
    commands = ArcCommands("drive", {Drive: "scout", Halt: "scout"}, ["scout"], "scout")
    with pytest.raises(NoSuchAction, match="drive has no command jump; it has: drive, halt"):
        commands.by_word(GiveCommand("jump", {}))
    with pytest.raises(WrongCommand):
        commands.by_word(GiveCommand("drive", {"left_rad_s": "fast", "right_rad_s": 2.0}))


def test_forms_name_the_roles_that_obey() -> None:
    forms = ArcCommands("drive", {Drive: "scout", Halt: ["left", "right"]}, ["scout", "left", "right"], "").forms()
    assert {form.word: form.roles for form in forms} == {"drive": ["scout"], "halt": ["left", "right"]}
