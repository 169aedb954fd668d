"""Grants beside transmitters."""

from __future__ import annotations

from typing import Any

from mission_control.laboratory.experiments.audit import Agreement, Transmitting, agreement

LINES: list[dict[str, Any]] = [
    {"ev": "connect", "t": 0.0, "arc": "a", "epoch": {"scout1": 1, "video1": 1, "radio": 1}},
    {"ev": "grant", "t": 0.3, "arc": "a", "epoch": {"scout1": 1}},
    {"ev": "revoke", "t": 5.3, "arc": "a", "why": "slice"},
    {"ev": "free", "t": 5.302, "arc": "a"},
    {"ev": "connect", "t": 5.302, "arc": "b", "epoch": {"scout2": 1, "video1": 2, "radio": 2}},
    {"ev": "grant", "t": 5.602, "arc": "b", "epoch": {"scout2": 1}},
]
SOUND = [
    Transmitting(0.0, {}),
    Transmitting(0.033, {"scout1": "video1"}),
    Transmitting(5.333, {"scout2": "video1"}),
]


def judged(samples: list[Transmitting], until_s: float = 8.0) -> Agreement:
    return agreement(LINES, samples, ["scout1", "scout2"], ["video1"], until_s)


def test_a_sound_run_agrees_at_every_switch() -> None:
    assert judged(SOUND) == Agreement(switches=3, jammed=0, broken=())


def test_a_robot_that_was_granted_and_is_silent_is_told_of() -> None:
    found = judged([Transmitting(0.0, {}), *SOUND[2:]])
    assert len(found.broken) == 1
    assert found.broken[0].startswith("scout1 was granted video1 from 0.300 to 5.300 s and at 0.000 s")


def test_a_robot_that_goes_silent_within_its_slice_is_told_of() -> None:
    assert len(judged([*SOUND[:2], Transmitting(3.0, {}), *SOUND[2:]]).broken) == 1


def test_a_robot_that_transmits_after_its_hold_is_told_of_and_jams() -> None:
    found = judged([*SOUND[:2], Transmitting(5.333, {"scout1": "video1", "scout2": "video1"})])
    assert found.jammed == 1
    assert len(found.broken) == 1
    assert "scout1 held nothing" in found.broken[0]


def test_the_wrong_frequency_is_told_of() -> None:
    found = judged([Transmitting(0.0, {"scout1": "video2"}), *SOUND[2:]])
    assert "transmitted on video2" in found.broken[0]


def test_a_robot_may_still_transmit_for_two_frames() -> None:
    assert judged(SOUND, until_s=5.303).broken == ()
