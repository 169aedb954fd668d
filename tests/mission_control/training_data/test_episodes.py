"""A step has what the commander could know, an episode is a grant."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import pytest
from driven_robot import ARCS, connected, disconnected, halted, holding, known, moved, reported, seen
from hypothesis import given
from hypothesis import strategies as st
from small_recordings import SCOUT, Said, recorded

from backbone.keys import Conversation
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.scheduling.requests import Holder
from mission_control.training_data.episodes import OWN_CAMERA, STILL, EpisodeStep, Follower, Survey, keys_of, survey

RATE_HZ = 10
WATCH, DRIVE = ARCS
speeds = st.floats(-1.0, 1.0)
happenings = st.one_of(
    st.tuples(st.just("grant"), st.sampled_from([WATCH, DRIVE])),
    st.tuples(st.just("revoke")),
    st.tuples(st.just("move"), speeds, speeds),
    st.tuples(st.just("late move"), speeds, speeds),
    st.tuples(st.just("halt")),
    st.tuples(st.just("report"), speeds),
    st.tuples(st.just("picture"), st.integers(0, 255)),
    st.tuples(st.just("nothing")),
)
nights = st.lists(st.tuples(st.floats(0.02, 0.5), happenings), max_size=25)


def followed(
    said: Iterable[Said], cameras: Iterable[str] | None = None, first: Iterable[Said] = ()
) -> tuple[Survey, Follower, list[EpisodeStep]]:
    """Return what a robot did in a recording of these messages; ``first`` names the owners of the ARCs."""
    file = recorded([*(first or known(0.1)), *said])
    found = survey(Recording(file).messages(keys_of("scout1")), "scout1")
    follower = Follower("scout1", found.reports, found.sizes_px if cameras is None else cameras, RATE_HZ)
    return found, follower, list(follower.follow(Recording(file).messages(keys_of("scout1"))))


class Night:
    """A robot's night as it is written down, and what was true in it at any time."""

    def __init__(self, script: list[tuple[float, tuple[object, ...]]]) -> None:
        self.said: list[Said] = []
        self.facts: list[tuple[float, str, object]] = []
        self.arc, self.epoch, at_s = "", 10, 1.0
        for after_s, happening in [*script, (0.3, ("nothing",))]:
            at_s = round(at_s + after_s, 6)
            self.happen(at_s, *happening)
        self.end_s = at_s

    def happen(self, at_s: float, what: object, *values: object) -> None:
        match what, values:
            case "grant", (str(arc),):
                self.epoch, self.arc = self.epoch + 1, arc
                self.say(at_s, "holder", (arc, self.epoch), *connected(at_s, arc, self.epoch))
            case "revoke", ():
                self.say(at_s, "holder", None, *disconnected(at_s, self.arc, self.epoch))
                self.arc = ""
            case "move", (float(forward), float(turn)):
                self.say(at_s, "action", (forward, turn), moved(at_s, self.epoch, forward, turn))
            case "late move", (float(forward), float(turn)):
                self.say(at_s, "nothing", None, moved(at_s, self.epoch - 1, forward, turn))
            case "halt", ():
                self.say(at_s, "action", STILL, halted(at_s, self.epoch))
            case "report", (float(value),):
                self.say(at_s, "report", value, reported(at_s, tilt_rad=value))
            case "picture", (int(level),):
                self.say(at_s, "picture", level, seen(at_s, self.arc or WATCH, level))
            case _:
                self.say(at_s, "nothing", None, reported(at_s))

    def say(self, at_s: float, name: str, value: object, *said: Said) -> None:
        self.said += said
        self.facts.append((at_s, name, value))

    def last(self, name: str, at_s: float, since_s: float) -> object:
        return next(
            (value for when, what, value in reversed(self.facts) if what == name and since_s <= when <= at_s), None
        )

    def grants(self) -> list[tuple[float, float, str]]:
        changes = [(at_s, value) for at_s, name, value in self.facts if name == "holder"]
        return [
            (begin_s, end_s, value[0])
            for (begin_s, value), (end_s, _) in itertools.pairwise([*changes, (self.end_s, None)])
            if isinstance(value, tuple)
        ]


@given(script=nights)
def test_steps_are_regular_and_have_what_was_newest(script: list[tuple[float, tuple[object, ...]]]) -> None:
    night = Night(script)
    found, follower, steps = followed(night.said)
    expected = []
    for begin_s, end_s, arc in night.grants():
        times = [at_s for at_s, *_ in night.facts if begin_s <= at_s <= end_s]
        known_s = [
            at_s
            for at_s in times
            if (not found.sizes_px or night.last("picture", at_s, begin_s) is not None)
            and (not found.reports or night.last("report", at_s, 0.0) is not None)
        ]
        times_s = (known_s[0] + number / RATE_HZ for number in itertools.count()) if known_s else iter(())
        for number, at_s in enumerate(itertools.takewhile(lambda at_s, end_s=end_s: at_s < end_s, times_s)):
            level = night.last("picture", at_s, begin_s) if found.sizes_px else None
            report = night.last("report", at_s, 0.0) if found.reports else None
            expected.append((number, at_s, arc, night.last("action", at_s, begin_s) or STILL, report, level))
    assert [
        (
            step.number,
            step.at_s,
            step.arc,
            step.action,
            *(step.state or (None,)),
            *([frame.pixels[0] for frame in step.pictures.values()] or (None,)),
        )
        for step in steps
    ] == expected
    assert follower.grants == len(night.grants())
    assert sorted({step.episode for step in steps}) == list(range(follower.episodes))


def test_a_person_is_named_by_name_and_a_behavior_by_its_own() -> None:
    said = [
        *connected(1.0, DRIVE, 7),
        *disconnected(2.0, DRIVE, 7),
        *connected(3.0, WATCH, 8),
        reported(4.0, way_m=1.0),
    ]
    found, _, steps = followed(said)
    assert [(found.commander(arc), found.is_of_a_person(arc)) for arc in (DRIVE, WATCH, "gone")] == [
        ("anna", True),
        ("watch", False),
        ("", False),
    ]
    assert (found.kind, found.robots, found.arcs, steps) == ("scout", {"scout1"}, {DRIVE, WATCH}, [])


def test_a_grant_that_began_before_the_recording_is_known_by_what_the_robot_says() -> None:
    found, follower, steps = followed([holding(1.0, DRIVE, 7), moved(1.05, 7, 0.5, 0.0), holding(2.0, "", 7)])
    assert (found.kind, found.arcs, follower.grants) == ("scout", {DRIVE}, 1)
    assert [step.action for step in steps] == [STILL, *[(0.5, 0.0)] * 9]


def test_a_grant_that_began_before_the_recording_is_in_the_first_schedule() -> None:
    later = known(3.0, Holder(WATCH, 8, 3.0, 5.0))
    said = [reported(1.0, way_m=1.0), moved(1.05, 7, 0.5, 0.0), *disconnected(2.0, DRIVE, 7), *later]
    found, follower, steps = followed(said, first=known(0.1, Holder(DRIVE, 7, 0.0, 2.0)))
    assert (found.arcs, follower.grants) == ({DRIVE, WATCH}, 1)
    assert [step.action for step in steps] == [STILL, *[(0.5, 0.0)] * 9]


@pytest.mark.parametrize(
    "end",
    [
        [holding(1.5, "", 7)],
        [Said(1.5, SCOUT, Conversation.ALIVE, Presence(False), source="")],
        connected(1.5, WATCH, 8),
    ],
)
def test_a_grant_ends_also_without_a_disconnect(end: list[Said]) -> None:
    _, _, steps = followed([*connected(1.0, DRIVE, 7), *end, reported(3.0)])
    assert len([step for step in steps if step.arc == DRIVE]) == 5


def test_each_camera_has_a_name_and_an_episode_needs_all() -> None:
    both = [seen(1.1, WATCH, 10), seen(1.2, WATCH, 20, (2, 2), "pan")]
    said = [*connected(1.0, WATCH, 7), *both, *connected(2.0, WATCH, 8), seen(2.1, WATCH, 30), reported(3.0)]
    found, follower, steps = followed(said)
    assert found.sizes_px == {OWN_CAMERA: (4, 2), "pan": (2, 2)}
    assert (follower.grants, follower.episodes, len(steps)) == (2, 1, 8)
    assert {name: frame.pixels[0] for name, frame in steps[0].pictures.items()} == {OWN_CAMERA: 10, "pan": 20}


@pytest.mark.parametrize("other", [{"body": {}}, {"schema": "Applied/99"}])
def test_an_episode_ends_at_a_message_of_another_form_which_is_counted(other: dict[str, Any]) -> None:
    said = [*connected(1.0, DRIVE, 7), moved(1.5, 7, 0.5, 0.0), holding(2.0, DRIVE, 7), moved(2.05, 7, 0.1, 0.0)]
    read = Recording(recorded([*known(0.1), *said, reported(3.0)])).messages(keys_of("scout1"))
    messages = [replace(one, **other) if one.at_s == 1.5 else one for one in read]
    found, follower = survey(messages, "scout1"), Follower("scout1", [], [], RATE_HZ)
    steps = list(follower.follow(messages))
    assert found.unread == 1
    assert [step.at_s for step in steps if step.episode == 0] == pytest.approx([1.0, 1.1, 1.2, 1.3, 1.4])
    assert [step.action for step in steps if step.episode == 1] == [STILL, *[(0.1, 0.0)] * 9]
