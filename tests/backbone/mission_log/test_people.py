"""Every text names the person at a console instead of the console and its ARCs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import ComponentState, LifeState
from backbone.mission_log.people import CONSOLES_KEPT, People, screens_of
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RequestView, Schedule

NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,12}", fullmatch=True)


def component(address: str, *, user: str = "", requester: str = "") -> ComponentState:
    return ComponentState(address, "any", "base", 1, LifeState.READY, 0.0, requester=requester, user=user)


ANNA = component("ui_console/console-24507", user="Anna B.")
WATCH = component("mission_control/watch1", user="nobody may claim to sit at a behavior")


@pytest.fixture
def people() -> People:
    return People([WATCH, ANNA])


@pytest.mark.parametrize(
    ("said", "read"),
    [
        ("console-24507", "Anna B."),
        ("ui_console/console-24507 asks", "Anna B. asks"),
        ("it was the turn of console-24507-capture, at last", "it was the turn of Anna B., at last"),
        ("held by console-24507-video-drive", "held by Anna B."),
        ("console-24507:100", "Anna B.:100"),
        ("console-245070 and console-24", "console-245070 and console-24"),
        ("because of ui_console/console-24507#12", "because of ui_console/console-24507#12"),
        ("watch1 waits for scout1", "watch1 waits for scout1"),
    ],
)
def test_a_console_and_what_it_claims_read_as_the_person_and_nothing_else_does(
    people: People, said: str, read: str
) -> None:
    assert people.named(said) == read


def test_every_text_of_a_message_is_named(people: People) -> None:
    arc, owner = "console-24507-drive", "ui_console/console-24507"
    request = RequestView(arc, owner, RequestState.RUNNING, ["scout1"], 0.0, -1.0, -1.0, "", [arc], 5.0, "", 1)
    [named] = people.named_all(Schedule(1.0, [], [request], [])).requests
    assert (named.arc, named.owner, named.blockers, named.rcs) == ("Anna B.", "Anna B.", ["Anna B."], ["scout1"])
    assert named.state is RequestState.RUNNING


def test_who_is_unknown_keeps_the_name() -> None:
    assert People().person("ui_console/console-1-capture") == "console-1-capture"


def test_a_person_is_remembered_after_leaving_but_not_without_end(people: People) -> None:
    for number in range(CONSOLES_KEPT):
        people.heard(component(f"ui_console/console-{number}x", user="ben"))
    assert people.person("console-24507") == "console-24507"
    assert people.person("console-0x") == "ben"


def test_one_person_at_two_consoles_has_two_screens() -> None:
    second = component("ui_console/anna-7-1", user="Anna B.")
    assert screens_of("Anna B.", [ANNA, WATCH, second, component("ui_console/c", user="ben")]) == [ANNA, second]
    assert screens_of("", [component("ui_console/a"), component("ui_console/b")]) == []


@given(st.text(max_size=80), NAMES)
def test_a_text_without_the_name_is_not_touched(text: str, name: str) -> None:
    people = People([component(f"ui_console/{name}", user="Anna")])
    if name not in text:
        assert people.named(text) == text
    assert people.named(name) == "Anna"
