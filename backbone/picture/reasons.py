"""``why`` and ``story``: ask the components that know about a name, and put their answers in order."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER, RC_MANAGER
from backbone.bus.interface import Bus, Clock, Reply
from backbone.component.messages import Absence, AskStory, ComponentState, Story, StoryEvent
from backbone.component.story import LENGTH as STORY_LENGTH
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import creator_name
from backbone.errors import LinkError, Refusal
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission_log.lines import event_json
from backbone.mission_log.log import AskLog, AskPeople, Log, PeopleKnown
from backbone.mission_log.people import People, is_console, screens_of
from backbone.module_waits import AskModule, ModuleWaits
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.naming import component_of, did_you_mean
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture
from backbone.picture.module_reasons import module_lines, modules_of
from backbone.picture.words import RULES, absence_line, stop_line
from backbone.placer.messages import (
    AskDeclared,
    AskPlacement,
    DeclaredOrder,
    ListPlacements,
    NotPlaced,
    Placement,
    Placements,
)
from backbone.printable import printable_all
from backbone.rc_manager.messages import AskWhy
from backbone.scheduling.requests import RequestState, UnknownRequest
from backbone.scheduling.views import Why
from backbone.spoken import counted
from backbone.wire import Message, plain

REPLY_TIME_S = 1.0  # chosen: a person waits this long

SHOWN_S = 0.05  # chosen: a shorter time is shown as 0.0 s


@dataclass(frozen=True)
class Reasons:
    """Reasons for the state of a name: its schedule, its placement, its own report; at least one of them.

    Attributes:
        name: Name in the question.
        why: The RC manager's answer, if it knows the name.
        placement: The placer's answer, if it placed it.
        component: The component's own report, if there is one.
        absence: Its absence, if it is wanted and absent.
        led_to: If the name is the id of a message: the events that the message led to.
        remarks: Further facts about a host, about a person, about a module, or about a message that led to nothing.
        people: The person at each console; the answer names persons.
    """

    name: str
    why: Why | None
    placement: Placement | None
    component: ComponentState | None
    absence: Absence | None = None
    led_to: Sequence[StoryEvent] = ()
    remarks: Sequence[str] = ()
    people: People = field(default_factory=People)

    @property
    def is_known(self) -> bool:
        """True if there is a reason."""
        return any((self.why, self.placement, self.component, self.absence, self.led_to, self.remarks))

    def lines(self, now_s: float) -> list[str]:
        """Return the reasons for people."""
        return [self.people.named(line) for line in self._lines(now_s)]

    def _lines(self, now_s: float) -> list[str]:
        lines = [*self.remarks] if self.absence is None else [absence_line(self.absence, now_s), *self.remarks]
        if self.component is not None and self.component.stop is not None:
            lines.append(stop_line(self.name, self.component.stop, now_s))
        if self.why is not None:
            lines += [f"{self.name}: {self.why.state}", *(f"  {line}" for line in self.why.lines)]
            if self.why.expected_start_s >= 0:
                lines.append(f"  {_start_text(self.why, now_s)}")
            if self.why.would_change:
                changes = "it starts as soon as" if self.why.state == RequestState.WAITING else "this changes when"
                lines.append(f"  {changes} {self.why.would_change}")
            lines.append(f"  rule {self.why.rule}: {RULES.get(self.why.rule, 'see the documentation')}")
        if self.component is not None:
            doing = f": {self.component.feedback}" if self.component.feedback else ""
            lines.append(f"{self.name} is {self.component.state} on {self.component.host}{doing}")
        if self.placement is not None:
            where = (
                f"was placed on {self.placement.host}" if self.placement.host else "waits for a host that can take it"
            )
            lines.append(f"{self.name} {where}, wanted by {self.placement.requester}")
            lines += [f"  {reason}" for reason in self.placement.reasons]
        if self.led_to:
            lines.append("this message led to:")
            lines += [f"  {event.at_s:.3f} s  {event.where}  {event.subject}: {event.what}" for event in self.led_to]
        return lines

    def to_json(self) -> dict[str, object]:
        """Return the reasons as plain data."""
        return {
            "name": self.name,
            "why": plain(self.why),
            "placement": plain(self.placement),
            "stop": plain(self.component.stop) if self.component else None,
            "absent": plain(self.absence),
            "led_to": [event_json(event) for event in self.led_to],
            "remarks": list(self.remarks),
        }


def _start_text(why: Why, now_s: float) -> str:
    in_s = why.expected_start_s - now_s
    what = "expected to start" if why.state in list(RequestState) else "next grant expected"
    return f"{what} in {in_s:.1f} s" if in_s >= SHOWN_S else f"{what} now"


@dataclass(frozen=True)
class AskedName:
    """Meaning of a name that a person types.

    Attributes:
        name: Name of the component, request or resource.
        message: Id of the meant message, ``<address>#<number>``; empty: none.
    """

    name: str
    message: str = ""

    @classmethod
    def of(cls, text: str) -> AskedName:
        """Return the meaning of a name, an address, an alarm, or the id of a message, with its subsystem or without.

        Example:
            >>> AskedName.of("backbone/rc_manager").name, AskedName.of("lost:scout1").name
            ('rc_manager', 'scout1')
            >>> AskedName.of("rc_manager#112")
            AskedName(name='rc_manager', message='rc_manager#112')
        """
        address, number, _ = text.rpartition(":")[2].partition("#")
        return cls(component_of(address), text if number else "")


async def reasons_for(bus: Bus, text: str, clock: Clock) -> Reasons:
    """Ask RC manager, placer and nameserver about a name, an address or a message.

    Raises:
        UnknownName: None of them knows it.
        LinkError: None of them answered.
    """
    asked = AskedName.of(text)
    name = asked.name
    why, placement, resolved, picture = await asyncio.gather(
        _or_error(bus, RC_MANAGER, AskWhy(name), Why),
        _or_error(bus, PLACER, AskPlacement(name), Placement),
        _or_error(bus, NAMESERVER, Resolve(name), Resolved),
        _seen(bus, clock),
    )
    told = await story_of(bus, text, clock) if asked.message else FoundEvents(())
    remarks = [*host_remarks(name, picture), *person_remarks(name, picture)]
    if isinstance(resolved, Resolved):
        remarks += absences_of_host(resolved.component, picture)
    else:
        remarks += await _module_remarks(bus, name, picture)
    if asked.message and not told.events:
        remarks.append(
            f"no component has an event that {asked.message} led to; each keeps its newest {STORY_LENGTH} events"
        )
    if isinstance(placement, NotPlaced) and placement.facts.get("stopped"):
        remarks.append(placement.detail)
    reasons = Reasons(
        name,
        why if isinstance(why, Why) else None,
        placement if isinstance(placement, Placement) else None,
        resolved.component if isinstance(resolved, Resolved) else None,
        next((absence for absence in picture.health.absent if absence.name == name), None),
        told.events,
        remarks,
        picture.people,
    )
    if not reasons.is_known:
        errors = [one for one in (why, placement, resolved) if isinstance(one, Refusal | LinkError)]
        raise next((e for e in errors if not isinstance(e, UnknownName | UnknownRequest | NotPlaced)), errors[-1])
    return printable_all(reasons)


async def _module_remarks(bus: Bus, name: str, picture: MissionPicture) -> list[str]:
    """Return what the module of this name waits for; none if no execution unit of the mission has it."""
    units = [state for state in picture.components.values() if state.type == EXECUTION_UNIT]
    answers = await asyncio.gather(*(_or_error(bus, state.address, AskModule(name), ModuleWaits) for state in units))
    silent = {absence.name: absence_line(absence, picture.at_s) for absence in picture.health.absent}
    for state, waits in zip(units, answers, strict=True):
        if isinstance(waits, ModuleWaits):
            return module_lines(name, state, waits, picture.components)
        if isinstance(waits, LinkError):
            silent.setdefault(component_of(state.address), str(waits))
    ordered = {process.spawn.name: process.spawn for process in picture.processes.values()}
    for unit, why in silent.items():
        if unit in ordered and name in modules_of(ordered[unit]):
            return [f"{name} is a module of {unit}, which does not run it", f"  {why}"]
    placed = await _or_error(bus, PLACER, ListPlacements(), Placements)
    stopped = await stopped_unit(bus, name, placed.stopped) if isinstance(placed, Placements) else ""
    return [stopped] if stopped else []


async def stopped_unit(bus: Bus, module: str, stopped: Mapping[str, str]) -> str:
    """Return that the unit of this module was stopped, and how to start it; empty: none of these has the module.

    Args:
        stopped: Name of a component that was ordered to stop → reason.
    """
    answers = await asyncio.gather(*(_or_error(bus, LAUNCHER, AskDeclared(one), DeclaredOrder) for one in stopped))
    for unit, answer in zip(stopped, answers, strict=True):
        if isinstance(answer, DeclaredOrder) and answer.order is not None and module in modules_of(answer.order):
            start = f"scout-backbone start {EXECUTION_UNIT} --name {unit}"
            return f"{module} is a module of {unit}, which was stopped, {stopped[unit]}; start it by '{start}'"
    return ""


def absences_of_host(component: ComponentState, picture: MissionPicture) -> list[str]:
    """Return what is wrong with the machine of this component."""
    return [absence_line(absence, picture.at_s) for absence in picture.health.absent if absence.name == component.host]


def host_remarks(name: str, picture: MissionPicture) -> list[str]:
    """Return the facts of a machine of the mission; none if no machine has this name."""
    there = [component_of(at) for at, component in sorted(picture.components.items()) if component.host == name]
    missed = [absence for absence in picture.health.absent if absence.name == creator_name(name)]
    if not missed and not any(c.host == name and c.type == CREATOR for c in picture.components.values()):
        return []
    lines = [
        f"{name} is a machine of the mission, with {counted(len(there), 'component')}: {', '.join(there) or 'none'}"
    ]
    return lines + [absence_line(absence, picture.at_s) for absence in missed]


def person_remarks(name: str, picture: MissionPicture) -> list[str]:
    """Return the consoles of a person, and their requests; none if no person has this name."""
    screens = screens_of(name, picture.components.values())
    if not screens:
        return []
    lines = [f"{name} sits at {counted(len(screens), 'console')}"]
    for screen in screens:
        lines.append(f"  on {screen.host}: {screen.feedback or screen.state}")
        lines += [
            f"  {request.because.removeprefix(f'{request.arc} ')}"
            for request in (picture.schedule.requests if picture.schedule is not None else [])
            if request.owner == screen.address
        ]
    return lines


@dataclass(frozen=True)
class FoundEvents:
    """Events from the stories of a mission's components.

    Attributes:
        events: In the order of their times.
        missing: Components that did not answer, with reasons: the events are incomplete.
        people: Present and past persons at the consoles of the events.
        similar: Remark with the most similar name of a component, if the name is none; empty: no name is similar.
    """

    events: Sequence[StoryEvent]
    missing: Sequence[str] = ()
    people: People = field(default_factory=People)
    similar: str = ""


async def story_of(bus: Bus, text: str, clock: Clock) -> FoundEvents:
    """Ask every component for the events about a name, an address or a message.

    The mission's log adds those of components that have ended.

    Raises:
        LinkError: The nameserver did not answer: there is no list of components to ask.
    """
    asked = AskedName.of(text)
    listing = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
    picture, logged, stories = await asyncio.gather(
        _seen(bus, clock),
        _logged(bus, asked),
        asyncio.gather(*(_or_error(bus, c.address, _question(c.address, asked), Story) for c in listing.components)),
    )
    told = [event for story in stories if isinstance(story, Story) for event in story.events]
    events = [*told, *(event for event in logged if event not in told)]
    missing = [
        f"{component.address}: {story}"
        for component, story in zip(listing.components, stories, strict=True)
        if not isinstance(story, Story)
    ]
    missing += [f"{address}: it has not registered yet" for address in listing.unknown]
    named = {component_of(missed.partition(": ")[0]) for missed in missing}
    absent = [each for each in picture.health.absent if each.name not in named]
    missing += [f"{each.name}: it is absent, {each.cause}" for each in absent]
    if not listing.complete:
        missing.append("the nameserver has just started: components may be missing in its list")
    names = {component_of(component.address) for component in listing.components}
    similar = "" if asked.name in names else did_you_mean(asked.name, names)
    return printable_all(FoundEvents(sorted(events, key=lambda event: event.at_s), missing, picture.people, similar))


async def _seen(bus: Bus, clock: Clock) -> MissionPicture:
    """Return the mission's picture with the persons at its consoles, as far as nameserver and launcher answer."""
    picture, known = await asyncio.gather(_looked(bus, clock), _or_error(bus, LAUNCHER, AskPeople(), PeopleKnown))
    if isinstance(known, PeopleKnown):
        picture.take(known)
    return picture


async def _looked(bus: Bus, clock: Clock) -> MissionPicture:
    """Return the mission's picture; an empty one if the nameserver does not answer, which other questions report."""
    try:
        return await look(bus, clock.now_s(), rate=clock.rate)
    except (Refusal, LinkError):
        return MissionPicture(bus.mission)


async def _logged(bus: Bus, asked: AskedName) -> list[StoryEvent]:
    """Return the newest events about the name in the mission's log, except those of consoles, which come and go.

    There are none if the launcher does not answer.
    """
    if asked.message:
        return []
    log = await _or_error(bus, LAUNCHER, AskLog(robot=asked.name, most=STORY_LENGTH), Log)
    return [event for event in log.events if not is_console(event.where)] if isinstance(log, Log) else []


def _question(address: str, asked: AskedName) -> AskStory:
    """Return the question for one component: the named component gets a question for its whole story."""
    if asked.message:
        return AskStory(asked.message)
    return AskStory() if component_of(address) == asked.name else AskStory(asked.name)


async def _or_error(bus: Bus, address: str, question: Message, reply: type[Reply]) -> Reply | Refusal | LinkError:
    try:
        return await bus.ask(address, question, reply, within_s=REPLY_TIME_S)
    except (Refusal, LinkError) as error:
        return error
