"""Audit: grants and transmitters must agree at each recorded switch, and no frequency may have two transmitters.

Pure. It compares the RC manager's decisions (the schedule trace) with the robots' transmitters.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from backbone.scheduling.trace import Line

FRAME_S = 1.0 / 30.0
SLACK_S = 2 * FRAME_S + 0.01  # chosen: packets take milliseconds and take effect at the next frame


@dataclass(frozen=True, slots=True)
class Transmitting:
    """The transmitting robots from one frame until the next sample.

    Attributes:
        at_s: Mission time of the frame.
        on: Robot → frequency.
    """

    at_s: float
    on: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Agreement:
    """The result of the audit.

    Attributes:
        switches: Number of compared grants and ends of holds.
        jammed: Frames from which on a frequency had two transmitters.
        broken: One line for each disagreement.
    """

    switches: int
    jammed: int
    broken: tuple[str, ...]


@dataclass(slots=True)
class _Hold:
    robot: str
    frequency: str


def agreement(
    trace: Iterable[Line],
    samples: Sequence[Transmitting],
    robots: Iterable[str],
    frequencies: Iterable[str],
    until_s: float,
) -> Agreement:
    """Compare each grant and each end of a hold with the transmitters at that time.

    From a grant until its revocation, the ARC's robot transmits on the ARC's frequency. From two frames after the end
    of the hold until its next connection, it does not transmit.

    Args:
        trace: Lines of the schedule trace, in order.
        samples: Transmitting robots, one sample for each frame with a change, in order.
        until_s: Time of the last possible sample; later switches are ignored.
    """
    scouts, channels = set(robots), set(frequencies)
    holds: dict[str, _Hold] = {}
    granted: dict[str, float] = {}
    freed: dict[str, float] = {}
    switches = 0
    broken: list[str] = []
    for line in trace:
        event, at_s, arc = line["ev"], float(line["t"]), line.get("arc", "")
        match event:
            case "connect":
                held = set(line["epoch"])
                robot, frequency = next(iter(held & scouts), ""), next(iter(held & channels), "")
                if robot and frequency:
                    holds[arc] = _Hold(robot, frequency)
                    if robot in freed:
                        switches += 1
                        broken += _not_off(samples, robot, freed.pop(robot) + SLACK_S, at_s)
            case "grant" if arc in holds:
                granted[arc] = at_s
            case "revoke" | "free" if arc in granted:
                switches += 1
                broken += _not_on(samples, holds[arc], granted.pop(arc), at_s)
        if event == "free" and arc in holds:
            freed[holds.pop(arc).robot] = at_s
    for arc, since_s in granted.items():
        switches += 1
        broken += _not_on(samples, holds[arc], since_s, until_s)
    for robot, since_s in freed.items():
        switches += 1
        broken += _not_off(samples, robot, since_s + SLACK_S, until_s)
    jammed = sum(len(set(sample.on.values())) < len(sample.on) for sample in samples)
    return Agreement(switches, jammed, tuple(broken))


def _during(samples: Sequence[Transmitting], begin_s: float, end_s: float) -> Iterable[Transmitting]:
    """Yield the sample valid at the begin, and all later samples before the end."""
    for number, sample in enumerate(samples):
        over = samples[number + 1].at_s <= begin_s if number + 1 < len(samples) else False
        if not over and sample.at_s < end_s:
            yield sample


def _not_on(samples: Sequence[Transmitting], hold: _Hold, begin_s: float, end_s: float) -> list[str]:
    return [
        f"{hold.robot} was granted {hold.frequency} from {begin_s:.3f} to {end_s:.3f} s and at {sample.at_s:.3f} s "
        f"transmitted on {sample.on.get(hold.robot, 'nothing')}"
        for sample in _during(samples, begin_s, end_s)
        if sample.on.get(hold.robot) != hold.frequency
    ]


def _not_off(samples: Sequence[Transmitting], robot: str, begin_s: float, end_s: float) -> list[str]:
    if begin_s >= end_s:
        return []
    return [
        f"{robot} held nothing from {begin_s:.3f} to {end_s:.3f} s and at {sample.at_s:.3f} s transmitted on "
        f"{sample.on[robot]}"
        for sample in _during(samples, begin_s, end_s)
        if robot in sample.on
    ]
