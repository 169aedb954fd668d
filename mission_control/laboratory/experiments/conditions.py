"""Conditions of the surveillance experiment, with the papers' results. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec

from backbone.errors import Refusal
from mission_control.laboratory.experiments.geometry import EXTRAS, PASSAGES, SLICE_S, WATCHERS, Passage

Policy = Literal["paper", "adaptive"]
Order = Literal["active-first", "extra-first", "interleaved"]

CONSOLE_SLICE_S = 2.0  # chosen: half the time for which a Pioneer is in view, so that no slice hides it
MOST_CHANNELS = 4  # chosen: the Scouts of the papers had two
SHORTEST_SLICE_S = 0.1  # chosen: one or two pictures; in less a watcher sees nothing
FEWEST, MOST = 2, 10  # robots of the load experiment
SLOWEST_M_S = 0.01  # chosen: a quarter of an hour through the room; a trial lasts as long


class ImpossibleCondition(Refusal):
    """The condition is impossible."""

    code = "experiment.condition"
    remedy = "See 'scout-backbone experiment surveillance --help' for what is possible."


class Condition(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The values that differ between runs; the geometry is always the same.

    Attributes:
        active: Scouts that watch.
        extra: Scouts that consoles hold, of the mission's own priority.
        channels: Video frequencies, each with a framegrabber.
        policy: ``paper``: all ARCs request ``slice_s``, in turns. ``adaptive``: watchers compute and draw their run
            times and request an extension at a glimpse; ARCs of equal priority get equal time; consoles request at most
            ``CONSOLE_SLICE_S``, and no time while they do not drive.
        target: ``pioneer`` or ``person``.
        speed_m_s: Speed of the target, at least ``SLOWEST_M_S``; 0: the papers' speed.
        slice_s: Run time of watchers and consoles in the mission file, seconds.
        order: Order of the claims of watchers and consoles, and thus of their turns.
        driven: Share of the time in which each console drives.
        noise: Noise of the pictures: 0 none, 1 as in the papers.
        frames_wanted: Number of pictures of one slice with certain motion before a watcher publishes it.
    """

    active: Annotated[int, msgspec.Meta(ge=1, le=len(WATCHERS))] = 2
    extra: Annotated[int, msgspec.Meta(ge=0, le=len(EXTRAS))] = 0
    channels: Annotated[int, msgspec.Meta(ge=1, le=MOST_CHANNELS)] = 1
    policy: Policy = "paper"
    target: Literal["pioneer", "person"] = "pioneer"
    speed_m_s: Annotated[float, msgspec.Meta(ge=0, le=10)] = 0.0
    slice_s: Annotated[float, msgspec.Meta(ge=SHORTEST_SLICE_S, le=600)] = SLICE_S
    order: Order = "active-first"
    driven: Annotated[float, msgspec.Meta(ge=0, le=1)] = 1.0
    noise: Annotated[float, msgspec.Meta(ge=0, le=10)] = 1.0
    frames_wanted: Annotated[int, msgspec.Meta(ge=1, le=100)] = 7

    def __post_init__(self) -> None:
        if 0 < self.speed_m_s < SLOWEST_M_S:
            raise ValueError(f"speed_m_s is {self.speed_m_s:g}: a target needs at least {SLOWEST_M_S:g} m/s")

    @property
    def passage(self) -> Passage:
        """The passage of the target, at the speed of this condition."""
        usual = PASSAGES[self.target]
        if not self.speed_m_s:
            return usual
        return Passage(usual.shape, self.speed_m_s, usual.there_and_back, usual.radius_m)

    @property
    def console_slice_s(self) -> float:
        """Run time that consoles ask for, seconds."""
        return self.slice_s if self.policy == "paper" else min(self.slice_s, CONSOLE_SLICE_S)

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of all Scouts, watching ones first."""
        return tuple(f"scout{number}" for number in range(1, self.active + self.extra + 1))

    @property
    def watching(self) -> tuple[str, ...]:
        """Names of the watching Scouts."""
        return self.robots[: self.active]

    @property
    def driven_robots(self) -> tuple[str, ...]:
        """Names of the Scouts that consoles hold."""
        return self.robots[self.active :]

    @property
    def in_turn(self) -> tuple[str, ...]:
        """Names of all in the order of their first turns.

        Example:
            >>> Condition(active=2, extra=2, order="interleaved").in_turn
            ('scout1', 'scout3', 'scout2', 'scout4')
        """
        match self.order:
            case "active-first":
                return self.robots
            case "extra-first":
                return (*self.driven_robots, *self.watching)
            case "interleaved":
                most = max(self.active, self.extra)
                return tuple(
                    robot
                    for number in range(most)
                    for robot in (*self.watching[number : number + 1], *self.driven_robots[number : number + 1])
                )

    def title(self) -> str:
        """Return the condition in one line."""
        words = [f"{self.active} active, {self.extra} extra, {self.target} {self.passage.speed_m_s:g} m/s"]
        words += [f"{self.channels} channels"] * (self.channels > 1)
        words += [f"driven {self.driven:.0%}"] * (self.extra > 0 and self.driven < 1)
        words += [f"slices {self.slice_s:g} s"] * (self.slice_s != SLICE_S)
        words += [f"order {self.order}"] * (self.order != "active-first")
        words += ["no noise" if not self.noise else f"noise x {self.noise:g}"] * (self.noise != 1)
        words += [f"{self.frames_wanted} frames"] * (self.frames_wanted != Condition().frames_wanted)
        return ", ".join(words)


def checked(**wanted: object) -> Condition:
    """Return the condition with these values.

    Raises:
        ImpossibleCondition: A value is impossible; the detail names it with the reason.
    """
    try:
        return msgspec.convert(wanted, Condition)
    except msgspec.ValidationError as error:
        raise ImpossibleCondition(str(error)) from None


class Published(msgspec.Struct, frozen=True):
    """A paper's result under a condition.

    Attributes:
        source: Paper and figure.
        detected: Number of trials with a detection.
        trials: Number of trials; 0: the paper gives no count.
        said: The paper's words.
    """

    source: str
    detected: int
    trials: int
    said: str


IROS = "IROS 2001, figure 4"
RAM = "RAM 2002"

PUBLISHED: dict[Condition, Published] = {
    Condition(extra=0): Published(IROS, 16, 20, "80 %"),
    Condition(extra=1): Published(IROS, 15, 20, "75 %"),
    Condition(extra=2): Published(IROS, 12, 20, "60 %"),
    Condition(extra=3): Published(IROS, 10, 20, "50 %"),
    Condition(target="person"): Published(RAM, 18, 22, "81 %"),
    Condition(target="person", extra=2): Published(RAM, 12, 22, "below 57 %"),
    Condition(channels=2, noise=0.0): Published("IROS 2001, preliminary", 0, 0, "100 %"),
}
"""18 of 22 is the nearest to the 81 % of RAM 2002 that 22 trials can give, 12 of 22 the most that is below 57 %."""

PAPERS: Sequence[Condition] = tuple(PUBLISHED)
QUARTER: Sequence[Condition] = tuple(Condition(extra=extra, policy="adaptive", driven=0.25) for extra in range(4))
ALWAYS: Sequence[Condition] = tuple(Condition(extra=extra, policy="adaptive") for extra in range(1, 4))
SPEEDS_M_S = (0.35, 0.5, 0.9)
"""Fixed periods resonate with a target's timing; so policies are compared over a range of speeds."""
BESIDE: Sequence[Condition] = tuple(
    Condition(extra=2, policy=policy, speed_m_s=speed_m_s)
    for speed_m_s in SPEEDS_M_S
    if speed_m_s != PASSAGES["pioneer"].speed_m_s
    for policy in ("paper", "adaptive")
)
EVERYTHING: Sequence[Condition] = (*PAPERS, *QUARTER, *ALWAYS, *BESIDE)
"""The conditions without further options."""


def load_conditions(policy: Policy = "paper", channels: int = 1, driven: float = 1.0) -> Sequence[Condition]:
    """Return a condition for each number of robots: two watch, the others are held by consoles.

    Source: IROS 2001, "Conclusions": one channel is of no use beyond about 8 or 9 robots.
    """
    return tuple(
        Condition(extra=robots - FEWEST, policy=policy, channels=channels, driven=driven)
        for robots in range(FEWEST, MOST + 1)
    )
