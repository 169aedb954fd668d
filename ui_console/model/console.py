"""The pure console model: the state of one console, and the views that its screens show.

Rules of this file: no bus, no clock, no screen. Events go in, views come out; times are mission seconds, and *now* is
an argument. Terminal, web page and scripts show the same views.

A separate ``TeamModel`` has the mission's part; consoles in one process may share it. This model has one operator's
part: the robot wanted, the robot held, the arriving pictures.
"""

from __future__ import annotations

from collections import deque

import msgspec

from backbone.component.messages import StoryEvent
from backbone.naming import Subsystem, component_of
from backbone.picture.words import UNDECIDED, WANTED, why_lost
from backbone.scheduling.views import Why
from resource_pool.arc_client import EmergencyStopped, GivenBeforeStop, Suspended
from ui_console.model import events, views
from ui_console.model.alarms import AlarmBook
from ui_console.model.applied import command_line, slice_end_line
from ui_console.model.arc_abilities import SLOW, ArcAbilities, Reach
from ui_console.model.consent import Settled, Sought, Topic
from ui_console.model.lifting import question_line
from ui_console.model.order_board import OrderBoard
from ui_console.model.team import TeamModel

STALE_S = 1.0  # chosen: at 0.3 m/s a Scout moves three of its lengths in this time
SILENT_S = 3.0  # chosen: time from the grant to the first picture: frequencies settle, drivers open
RATE_OVER_S = 2.0  # chosen: a rate a person can read
ANSWER_SHOWN_S = 10.0  # chosen: long enough to be read, short enough not to be mistaken for news
LOG_SHOWN = 100  # chosen: more than a screen has lines
BACK_REMEDY = "Other ARCs may have moved it meanwhile: look where it is before you drive."


class ConsoleModel:
    """The state of one console; screens read it, events change it.

    Args:
        team: Model of the mission; None: a new one.
        sees: True if pictures are expected while a robot is held whose ARC gives any; their absence then raises an
            alarm.
        alarms: Book for this console's alarms; None: a book of its own.
    """

    def __init__(
        self,
        name: str,
        user: str = "",
        team: TeamModel | None = None,
        *,
        sees: bool = True,
        alarms: AlarmBook | None = None,
    ) -> None:
        self.name, self.user = name, user or name
        self.team = team or TeamModel()
        self.robot = ""
        """Robot requested or held; empty: any, or none."""
        self.held: events.Granted | None = None
        self.lost: Suspended | None = None
        self.asked: events.Asked | None = None
        self.why: Why | None = None
        self.applied: events.CommandApplied | None = None
        self.abilities: ArcAbilities | None = None
        """Abilities of the requested or held ARC; None: not known."""
        self.orders = OrderBoard()
        """The operator's orders to robots."""
        self.sees = sees
        """Whether pictures are expected while a robot is held; settable: a page may show other ones meanwhile."""
        self._address = f"{Subsystem.UI_CONSOLE}/{name}"
        self._pictures: dict[str, deque[events.PictureSeen]] = {}
        self._sought: dict[tuple[str, str, Topic], Sought] = {}
        self.moment = 0
        """Grows at each event after which older key presses are ignored."""
        self._must_let_go = False
        self._went: views.LostView | None = None
        self._asked_whom: events.ConsentAsked | None = None
        self._heard: list[events.ConsentHeard] = []
        self._confirmed_s = 0.0  # when the ARC last reported that its grant continues
        self._refused = ""  # reason of the refusal of the last claim, if it was refused
        self._blind = ""  # robot that is held without usable pictures
        self.alarms = alarms or AlarmBook(beside=self.team.alarms)
        """Alarms of this console alone."""

    def apply(self, event: events.ConsoleEvent) -> None:
        """Apply the event; an event of the whole mission goes to ``team``."""
        match event:
            case events.Heard(body=Why() as why):
                self.why = why
            case events.Heard(body=Suspended() as lost):
                self._take_loss(lost, event.at_s)
            case events.Heard() | events.LinkHeard():
                self.team.apply(event)
            case _:
                self._apply_own(event)

    def look(self, now_s: float) -> None:
        """Raise and end the alarms that depend on time; call it right before a view."""
        self.team.look(now_s)
        self.alarms.look(now_s)
        stale = self._stale_line(now_s)
        blind = self.robot if stale else ""
        if self._blind not in ("", blind):
            self.alarms.end(views.AlarmKind.STALE_VIDEO, self._blind, now_s)
        self._blind = blind
        if blind:
            remedy = "Stop; do not drive by an old picture."
            self.alarms.begin(views.AlarmKind.STALE_VIDEO, blind, stale, now_s, remedy)

    def alarm_views(self) -> list[views.AlarmView]:
        """Return the alarms for this console's operator; call it right after ``look``."""
        return self.team.alarm_views(self.alarms)

    def acknowledge(self, key: str = "") -> int:
        """Record that this console's user has seen one alarm and its consequences, or with an empty key all alarms.

        Returns:
            Number of alarms acknowledged.
        """
        keys = [one for view in self.alarm_views() if key in ("", view.key) for one in view.keys]
        if not keys:
            return 0
        return self.team.alarms.acknowledge(self.user, keys) + self.alarms.acknowledge(self.user, keys)

    def dismiss_lost(self) -> None:
        """Record that this console's user knows of the lost robot, and does not want it back."""
        self._went = None

    @property
    def reach(self) -> Reach | None:
        """Largest speeds of the ARC's body; ``SLOW`` while they are not known; None: the body cannot move."""
        return SLOW if self.abilities is None else self.abilities.reach

    def view(self, now_s: float) -> views.ConsoleView:
        """Return the content of a screen."""
        self.look(now_s)
        team = self.team
        return views.ConsoleView(
            mission=team.picture.mission,
            now_s=now_s,
            own=self.own(now_s),
            robots=self.robots(now_s),
            tree=team.tree(),
            requests=team.requests(),
            timeline=team.timeline(now_s),
            alarms=self.alarm_views(),
            hosts=team.links.hosts(now_s),
            links=self.links(now_s),
            videos=self.videos(now_s),
            parameters=team.parameters(),
            components=team.components(),
            log=self.log(),
            health=team.health(now_s),
            abilities=self.abilities,
        )

    def own(self, now_s: float) -> views.OwnView:
        """Return the robot that this console wants and holds, with its state."""
        held, link_down_s = self.held, self.team.links.down_s(now_s)
        return views.OwnView(
            console=self.name,
            user=self.user,
            robot=self.robot,
            is_held=self._is_held(now_s),
            is_asked=self.asked is not None,
            status=self.status_line(now_s),
            epoch=max(held.epochs.values(), default=0) if held is not None else 0,
            until_s=held.until_s if held is not None else views.NONE_S,
            taken_because=self._why_lost(self.lost) if self.lost is not None else "",
            applied=command_line(self.applied.command, self.applied.values) if self.applied is not None else "",
            stop=self.team.robots.stop_view(self.robot, now_s, self.user, self._address) if self.mine else None,
            away_since_s=self.team.alarms.away_since_s,
            consent=self.consent(now_s),
            asked=self.asked_line(now_s),
            other_screens=self.other_screens(),
            must_let_go=self._must_let_go and held is not None,
            lost=self._lost_view(now_s),
            link_down_s=link_down_s,
            moment=self.moment,
            orders=self.team.people.named_all(self.orders.views(now_s)),
            is_unsure=held is not None and self._confirmed_s < self.team.links.back_s,
        )

    @property
    def mine(self) -> str:
        """The robot that the operator has by stick or by order; of several, the one at the stick; empty: none."""
        return self.robot if self.held is not None or self.orders.of(self.robot) is not None else ""

    def other_screens(self) -> list[str]:
        """Return one line for each other screen of this console's person: its host and its activity."""
        own = [screen for screen in self.team.screens_of(self.user) if component_of(screen.address) != self.name]
        return [f"your other screen on {screen.host} {screen.feedback or 'watches'}" for screen in own]

    def consent(self, now_s: float) -> views.ConsentView | None:
        """Return the next question for this operator; None: no question is open."""
        if not self._sought:
            return None
        first, *others = self._sought.values()
        return views.ConsentView(
            user=first.user,
            robot=first.robot,
            why=first.why,
            left_s=max(0.0, first.until_s - now_s),
            others=len(others),
            topic=first.topic,
            line=_question_line(first),
            number=first.number,
        )

    def asked_line(self, now_s: float) -> str:
        """Return a line with other operators' answers to this console's questions; empty: no question was asked."""
        asked = self._asked_whom
        if asked is None:
            return ""
        if asked.topic is Topic.LIFT and now_s > asked.until_s + ANSWER_SHOWN_S:
            return ""
        said = [self._answer_line(heard) for heard in self._heard]
        if len(said) < len(asked.of):
            what = asked.robot if asked.topic is Topic.TAKE else f"leave to lift the stop of {asked.robot}"
            whom, left_s = ", ".join(map(self.team.person, asked.of)), max(0.0, asked.until_s - now_s)
            said.append(f"asked {whom} for {what}: {left_s:.0f} s left")
        return "; ".join(said)

    def robots(self, now_s: float) -> list[views.RobotView]:
        """Return one row for each robot, sorted by name; this console's own and its pictures are marked."""
        videos = {video.robot: video for video in self.videos(now_s)}
        mine = self.robot if self._is_held(now_s) else ""
        return [
            msgspec.structs.replace(
                row,
                is_mine=row.robot == mine,
                video=videos.get(row.robot),
                stop=self.team.robots.stop_view(row.robot, now_s, self.user, self._address),
            )
            for row in self.team.robots.views(now_s)
        ]

    def videos(self, now_s: float) -> list[views.VideoView]:
        """Return the state of the pictures of each robot, without released robots."""
        return [_video(robot, seen, now_s) for robot, seen in sorted(self._pictures.items())]

    def links(self, now_s: float) -> list[views.LinkView]:
        """Return the links of the mission, with the path of this console's commands."""
        links = self.team.links.views(now_s)
        if self.applied is not None and self.applied.took_s >= 0:
            line = f"{self.applied.command} was applied {max(0.0, now_s - self.applied.at_s):.1f} s ago"
            links.insert(1, views.LinkView(f"commands to {self.applied.rc}", True, self.applied.took_s, line))
        return links

    def log(self, count: int = LOG_SHOWN) -> list[StoryEvent]:
        """Return the newest events, oldest first."""
        return self.team.log(count)

    def status_line(self, now_s: float) -> str:
        """Return a line with the state of the claim: whether this console has its robot, and if not, why."""
        down_s = self.team.links.down_s(now_s)
        if down_s >= 0:
            mine = f"; {self.robot} is given back there by itself" if self.held is not None else ""
            return f"NO LINK to the mission for {now_s - down_s:.0f} s: nothing can be stopped from here{mine}"
        if self.mine and (stop := self.team.robots.stop_of(self.robot)) is not None:
            return f"{self.robot} is STOPPED by {stop.by}{f': {stop.reason}' if stop.reason else ''}"
        if self.held is not None:
            if self._confirmed_s < self.team.links.back_s:
                return f"the link is back; not yet known whether you still hold {self.robot or 'the RCs'}"
            return f"you hold {self.robot or 'no robot'}{slice_end_line(self.held.until_s, now_s)}"
        if self.asked is None:
            if (given := self.orders.of(self.robot)) is not None:
                return self.team.people.named(given.line)
            if self._refused:
                return f"you hold no robot: {self._refused}"
            there = "; ".join(self.other_screens())
            return f"watching; you hold no robot{f' here; {there}' if there else ''}"
        wanted = self.robot or "a robot"
        why = self.why
        if why is not None and why.lines:
            reason = why.lines[0].removeprefix(f"{why.name} {why.state}: ")  # for which the line has its own words
            return f"waiting for {wanted}: {self.team.people.named(reason)}"
        if self.lost is not None:
            return f"waiting for {wanted}: {self._why_lost(self.lost)}"
        return f"waiting for {wanted}"

    def _apply_own(self, event: events.OwnEvent) -> None:
        alarms = self.alarms
        match event:
            case events.ConsentAsked():
                self._asked_whom, self._heard = event, []
            case events.ConsentHeard():
                self._heard.append(event)
            case Sought(key=key):
                self._sought[key] = event
            case Settled(sought=sought):
                self._sought.pop(sought.key, None)
            case events.LetGoNeeded(is_needed=is_needed):
                self._must_let_go = is_needed
            case events.MomentBegan():
                self.moment += 1
            case events.OrderChanged():
                self.orders.take(event)
            case events.TurnedTo(robot=robot):
                self.robot = robot
            case events.Asked(robot=robot):
                self._asked_whom = self._went = None
                self._refused = ""
                self.asked, self.robot, self.held, self.lost, self.why = event, robot, None, None, None
            case events.AbilitiesKnown(abilities=abilities):
                self.abilities = abilities if self.asked is not None else None
            case events.Granted(robot=robot, at_s=at_s):
                self.held, self._confirmed_s, self.lost, self.why, self._asked_whom = event, at_s, None, None, None
                alarms.mended((views.AlarmKind.TAKEN, views.AlarmKind.REFUSED, views.AlarmKind.NO_ANSWER))
                if self._went is not None:
                    line = f"{robot} was lost and is yours again: {self._went.why}"
                    alarms.happened(views.AlarmKind.TAKEN, robot, line, at_s, BACK_REMEDY, key=f"back:{self.name}")
                self._went = None
                self.robot = robot or self.robot
            case events.HoldConfirmed(at_s=at_s):
                self._confirmed_s = at_s
            case events.CommandApplied():
                self.applied = event
                alarms.mended((views.AlarmKind.NO_ANSWER,))
            case events.CommandRefused(at_s=at_s, code=code, detail=detail, remedy=remedy, ends_claim=ends_claim):
                if ends_claim:
                    self.asked, self._refused = None, detail
                if code not in (EmergencyStopped.code, GivenBeforeStop.code):  # these have their own alarms
                    alarms.happened(
                        views.AlarmKind.REFUSED, self.robot, f"refused: {detail}", at_s, remedy, f"refused:{code}"
                    )
            case events.LinkTrouble(at_s=at_s, detail=detail):
                alarms.happened(views.AlarmKind.NO_ANSWER, self.robot, f"no answer: {detail}", at_s)
            case events.GivenBack(at_s=at_s, reason=reason, confirmed=confirmed, wanted=wanted):
                self._went = None if wanted else views.LostView(self.robot, reason, at_s, False)
                self.held = self.asked = self.lost = self.why = self.applied = self._asked_whom = None
                self.abilities = None
                self._pictures.clear()
                if not confirmed:
                    line = f"{self.robot} was given back, but its ARC did not confirm it"
                    alarms.happened(views.AlarmKind.NO_ANSWER, self.robot, line, at_s, key="given_back")
            case events.PictureSeen(robot=robot, at_s=at_s):
                seen = self._pictures.setdefault(robot, deque())
                seen.append(event)
                while at_s - seen[0].at_s > RATE_OVER_S:
                    seen.popleft()
            case events.Attention(at_s=at_s, is_there=is_there):
                self.team.alarms.attention(is_there, at_s)

    def _take_loss(self, lost: Suspended, at_s: float) -> None:
        self.held, self.lost = None, lost
        if lost.reason in UNDECIDED:
            self._went = views.LostView(self.robot, self._why_lost(lost), at_s, False)
        self._pictures.clear()
        if lost.reason != WANTED:
            line = f"{self.robot or 'the robot'} was taken from {self.user}: {self._why_lost(lost)}"
            self.alarms.happened(views.AlarmKind.TAKEN, self.robot, line, at_s, key=f"taken:{self.name}")

    def _why_lost(self, lost: Suspended) -> str:
        return why_lost(lost.reason, self.team.person(lost.by))

    def _answer_line(self, heard: events.ConsentHeard) -> str:
        who, reason = self.team.person(heard.user), f": {self.team.people.named(heard.reason)}" if heard.reason else ""
        if heard.topic is Topic.LIFT:
            what = f"lets {heard.robot} move" if heard.is_given else f"keeps {heard.robot} stopped"
            return f"{who} {what}{reason}"
        return f"{who} {'lets you have' if heard.is_given else 'keeps'} {heard.robot}{reason}"

    def _is_held(self, now_s: float) -> bool:
        """Return whether keys move a robot, according to this console's state."""
        return self.held is not None and self.team.links.down_s(now_s) < 0

    def _lost_view(self, now_s: float) -> views.LostView | None:
        went = self._went
        if went is None:
            return None
        is_up = any(row.robot == went.robot and row.is_up for row in self.team.robots.views(now_s))
        return msgspec.structs.replace(went, may_retake=is_up and self.asked is None)

    def _stale_line(self, now_s: float) -> str:
        """Return a line with the fault of the held robot's pictures; empty: they are fresh."""
        if self.held is None or not self.sees or (self.abilities is not None and not self.abilities.gives_pictures):
            return ""
        seen = self._pictures.get(self.robot)
        if not seen:
            silent_s = now_s - self.held.at_s
            return f"no picture of {self.robot} came within {silent_s:.0f} s" if silent_s > SILENT_S else ""
        age_s = now_s - seen[-1].captured_s
        return f"the picture of {self.robot} is {age_s:.1f} s old" if age_s > STALE_S else ""


def _video(robot: str, seen: deque[events.PictureSeen], now_s: float) -> views.VideoView:
    newest = seen[-1]
    age_s = max(0.0, now_s - newest.captured_s)
    span_s = newest.at_s - seen[0].at_s
    rate_hz = (len(seen) - 1) / span_s if span_s > 0 else 0.0
    return views.VideoView(robot, age_s, rate_hz, max(0.0, newest.at_s - newest.captured_s), age_s > STALE_S)


def _question_line(sought: Sought) -> str:
    if sought.topic is Topic.LIFT:
        return question_line(sought.user, sought.robot, sought.why)
    return f"{sought.user} asks for {sought.robot}{f': {sought.why}' if sought.why else ''}"
