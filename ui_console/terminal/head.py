"""The first lines: hold of the robot, health of the mission, and notices and questions to the operator.

Rules of this file: a view and a width go in, rich texts come out. If a fact does not fit beside facts of more weight,
it is shortened or left out; no fact is cut in the middle. A question has its own line, which wraps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich.text import Text

from backbone.spoken import counted
from ui_console.model.orders import OrderState
from ui_console.model.profile import Profile
from ui_console.model.views import ConsoleView, HealthView, LostView, VideoView
from ui_console.terminal.keys import has
from ui_console.terminal.lines import ALARM_STYLES

BETWEEN = " · "
ALARMING, ASKING = "bold white on red", "bold yellow"
WITHOUT_LINK = "x and X reach no robot now: stop at another console, or at the robot itself. What is shown is old."
TAKE_KEYS = {Profile.TERMINAL: "t", Profile.PENDANT: "enter"}
LATE_PICTURE_S = 0.25  # chosen: a few pictures at the usual rate; a person notices longer delays
ORDER_STYLES = {OrderState.FAILED: "bold red", OrderState.WAITING: "yellow", OrderState.DONE: "bold green"}
HEALTH_STYLES = {"ok": "green", "starting": "bold cyan", "degraded": "bold yellow", "failed": "bold red"}


@dataclass(frozen=True)
class Head:
    """The first lines.

    Attributes:
        status: One line of facts.
        says: Notices and questions to the operator, the most urgent first.
    """

    status: Text
    says: list[Text]


@dataclass(frozen=True)
class _Fact:
    """A part of the first line.

    Attributes:
        weight: If room is short, facts of more weight stay.
        text: The long form, if there is room.
        short: The short form.
    """

    weight: int
    text: Text
    short: Text


def head(view: ConsoleView, columns: int, profile: Profile, speed: float) -> Head:
    """Return the first lines of a console.

    Args:
        view: Its content.
        columns: Its width.
        profile: Its look.
        speed: Of the drive keys, as a share of the robot's most.
    """
    facts = list(_facts(view, profile, speed))
    status, is_told_whole = _fitted(facts, columns)
    says = list(_says(view, profile))
    if not is_told_whole:
        says.insert(0, Text(view.own.status))
    return Head(status, says)


def _facts(view: ConsoleView, profile: Profile, speed: float) -> Iterator[_Fact]:
    own = view.own
    is_alarming = own.stop is not None or own.link_down_s >= 0
    style = ALARMING if is_alarming else "bold black on green" if own.is_held and not own.is_unsure else "bold"
    short, _, reason = own.status.partition(": ")
    yield _Fact(9, Text(f" {own.status} ", style), Text(f" {short}{'…' if reason else ''} ", style))
    if view.health is not None:
        yield _health(view.health)
    stopped = [robot.robot for robot in view.robots if robot.stop is not None]
    if stopped and own.stop is None:
        yield _Fact(8, *_texts(f"STOPPED: {', '.join(stopped)}", f"{len(stopped)} STOPPED", "bold red"))
    unseen = [alarm for alarm in view.alarms if not alarm.acknowledged_by]
    if unseen:
        away = sum(alarm.while_away for alarm in unseen)
        count = counted(len(unseen), "alarm")
        told = f"{count}{f', {away} while you were away' if away else ''}"
        yield _Fact(7, *_texts(told, count, ALARM_STYLES[unseen[0].severity]))
    if own.taken_because and not own.is_held:
        yield _Fact(4, *_texts(f"taken: {own.taken_because}", "taken", "yellow"))
    if profile is not Profile.MONITOR:
        yield from _speed(view, speed)
        yield from (_picture(video) for video in view.videos if video.robot == own.robot)


def _says(view: ConsoleView, profile: Profile) -> Iterator[Text]:
    own = view.own
    if own.link_down_s >= 0:
        yield Text(WITHOUT_LINK, style=ALARMING)
    unsure = [robot.robot for robot in view.robots if robot.stop is not None and not robot.stop.is_confirmed]
    if unsure:
        yield Text(f"NOT SURE that {', '.join(unsure)} stopped", style="bold red")
    if own.lost is not None:
        keys = _lost_keys(own.lost, profile)
        yield Text(f"you lost {own.lost.robot} {view.now_s - own.lost.at_s:.0f} s ago: {own.lost.why}{keys}", ASKING)
    if own.consent is not None:
        others = f", {own.consent.others} more" if own.consent.others else ""
        yield Text(f"{own.consent.line} [g: yes, n: no; {own.consent.left_s:.0f} s{others}]", ASKING)
    if own.asked:
        yield Text(own.asked, ASKING)
    if own.is_asked:  # on a console that only watches, the first line already has it
        yield from (Text(screen, "bold") for screen in own.other_screens)
    yield from (Text(order.line, ORDER_STYLES.get(order.state, "")) for order in own.orders if order.line != own.status)
    if own.must_let_go:
        yield Text("let go, then press anew", ASKING)
    if own.away_since_s >= 0:
        yield Text("you are away: press any key", ASKING)


def _speed(view: ConsoleView, speed: float) -> Iterator[_Fact]:
    """Yield the speed of the drive keys, also in meters per second if known; nothing for a body that cannot move."""
    reach = view.abilities.reach if view.abilities is not None else None
    if view.abilities is None or reach is not None:
        most = f" ({speed * reach.forward_m_s:.2f} m/s)" if reach is not None else ""
        yield _Fact(3, *_texts(f"speed {speed:.0%}".replace("%", " %") + most, f"{speed:.0%}".replace("%", " %")))


def _lost_keys(lost: LostView, profile: Profile) -> str:
    take = [f"{TAKE_KEYS[profile]}: take it again"] if lost.may_retake and profile in TAKE_KEYS else []
    seen = ["k: seen"] if has(profile, "acknowledge") else []
    return f" [{', '.join(take + seen)}]" if take or seen else ""


def _health(health: HealthView) -> _Fact:
    first = f": {health.lines[0]}" if health.lines else ""
    told = f"mission {health.word}"
    return _Fact(6, *_texts(f"{told}{first}", told, HEALTH_STYLES[health.word]))


def _picture(video: VideoView) -> _Fact:
    style = "bold red" if video.is_stale else "yellow" if video.age_s > LATE_PICTURE_S else ""
    return _Fact(5, *_texts(f"picture {video.age_s:.1f} s old, {video.rate_hz:.0f}/s", f"{video.age_s:.1f} s", style))


def _texts(text: str, short: str, style: str = "") -> tuple[Text, Text]:
    return Text(text, style), Text(short, style)


def _fitted(facts: Sequence[_Fact], columns: int) -> tuple[Text, bool]:
    """Return the facts that fit, in order, and whether the first one is among them in its long form."""
    by_weight = sorted(range(len(facts)), key=lambda number: -facts[number].weight)
    shown: dict[int, Text] = {}
    for number in by_weight:
        if _width([*shown.values(), facts[number].short]) <= columns:
            shown[number] = facts[number].short
    for number in by_weight:
        longer = {**shown, number: facts[number].text}
        if number in shown and _width(list(longer.values())) <= columns:
            shown = longer
    if 0 not in shown:  # not even the short form of the heaviest fact fits
        cut = facts[0].short.copy()
        cut.truncate(columns, overflow="ellipsis")
        return cut, False
    return Text(BETWEEN).join(shown[number] for number in sorted(shown)), shown[0] == facts[0].text


def _width(texts: Sequence[Text]) -> int:
    return sum(text.cell_len for text in texts) + len(BETWEEN) * max(0, len(texts) - 1)
