"""Refusals travel as (code, detail, remedy, facts) and are raised again as the same class."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.errors import LinkError, NoResponder, Refusal, ReplyTimeout, UnknownRefusal, code_of, complaint, revive
from backbone.wire import Refused


class TooHeavy(Refusal):
    code = "test.heavy"
    remedy = "Carry less."


class FarTooHeavy(TooHeavy):
    """Adds no code of its own."""


class Counted(Refusal):
    code = "test.counted"

    def __init__(self, *, count: int) -> None:
        super().__init__(f"{count} of them", count=count)


text = st.text(max_size=20)
facts = st.dictionaries(text, st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | text)


def test_a_refusal_keeps_class_detail_remedy_and_facts() -> None:
    back = Refused.of(TooHeavy("scout1 weighs 2 kg", remedy="Take two.", kg=2.0, robot="scout1")).revive()
    assert type(back) is TooHeavy
    assert (back.detail, back.remedy, back.facts) == ("scout1 weighs 2 kg", "Take two.", {"kg": 2.0, "robot": "scout1"})
    assert str(back) == "scout1 weighs 2 kg (Take two.)"
    assert back.args == ("scout1 weighs 2 kg",)


def test_without_a_remedy_of_its_own_a_refusal_has_that_of_its_class() -> None:
    assert Refused.of(TooHeavy("2 kg")).revive().remedy == "Carry less."


def test_a_class_that_inherits_its_code_does_not_take_it_over() -> None:
    assert type(Refused.of(TooHeavy("2 kg")).revive()) is TooHeavy
    assert type(Refused.of(FarTooHeavy("9 kg")).revive()) is TooHeavy


def test_a_refusal_whose_class_takes_other_arguments_comes_back_too() -> None:
    back = Refused.of(Counted(count=3)).revive()
    assert type(back) is Counted
    assert (back.detail, back.facts) == ("3 of them", {"count": 3})


def test_an_unknown_code_stays_readable_and_travels_on_under_its_own_code() -> None:
    back = revive("elsewhere.defined", "no", "ask there", {"a": 1})
    assert type(back) is UnknownRefusal
    assert code_of(back) == "elsewhere.defined"
    again = Refused.of(back)
    assert (again.code, again.detail, again.remedy) == ("elsewhere.defined", "no", "ask there")


def test_a_refusal_made_of_an_exception_travels_with_its_text() -> None:
    """``raise HardwareFault(error)`` in a driver: encoding it failed in the bus, without the driver's place."""
    error: Any = OSError("no cable")
    back = Refused.of(TooHeavy(error)).revive()
    assert (back.detail, str(back)) == ("no cable", "no cable (Carry less.)")


def test_an_exception_whose_text_fails_is_named_all_the_same() -> None:
    """The task that it ended did not count as failed, and its component stood still without a word."""

    class Ugly(Exception):
        def __str__(self) -> str:
            raise LookupError

    assert complaint(Ugly()) == "Ugly: its __str__ raised LookupError"


@given(st.sampled_from(["refused", "test.heavy", "test.counted", "elsewhere"]) | text, text, text, facts)
def test_no_content_makes_reviving_fail(code: str, detail: str, remedy: str, told: dict[str, Any]) -> None:
    """Facts named like the constructor's arguments ("detail", "remedy", "self") included."""
    back = revive(code, detail, remedy, told)
    assert (back.detail, back.remedy) == (detail, remedy)
    assert code_of(back) == code or code in ("", Refusal.code, UnknownRefusal.code)


@pytest.mark.parametrize("name", ["detail", "remedy", "self", "code"])
def test_facts_may_have_any_name(name: str) -> None:
    assert revive("test.heavy", "no", "ask", {name: 1}).facts == {name: 1}


def test_no_answer_is_not_a_refusal() -> None:
    for kind in (NoResponder, ReplyTimeout):
        assert issubclass(kind, LinkError)
        assert not issubclass(kind, Refusal)


def test_a_complaint_names_the_line_of_the_developer_and_not_that_of_the_library_which_he_called() -> None:
    with pytest.raises(json.JSONDecodeError) as raised:
        json.loads("nonsense")
    assert complaint(raised.value).endswith(f"({__file__}, line {raised.traceback[0].lineno + 1})")


def test_a_complaint_names_the_innermost_line_of_his_package() -> None:
    def deeper() -> None:
        json.loads("nonsense")

    with pytest.raises(json.JSONDecodeError) as raised:
        deeper()
    assert complaint(raised.value).endswith(f"({__file__}, line {deeper.__code__.co_firstlineno + 1})")


def test_a_complaint_about_a_file_that_python_cannot_read_names_its_line(tmp_path: Path) -> None:
    with pytest.raises(SyntaxError) as raised:
        compile("def act(self:\n    pass\n", tmp_path / "own.py", "exec")
    assert complaint(raised.value).endswith(f"({tmp_path / 'own.py'}, line 1)")


def test_a_long_complaint_keeps_its_place() -> None:
    with pytest.raises(ValueError, match="x") as raised:
        raise ValueError("x" * 1000)
    assert complaint(raised.value, 100).endswith(f" more) ({__file__}, line {raised.traceback[0].lineno + 1})")
