"""``why`` and ``story``: ask whoever knows, and put their answers in order."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Any

from backbone.bus.interface import Bus
from backbone.component.messages import AskStory, ComponentState, Story, StoryEvent
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import ADDRESS as NAMESERVER
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.placer.messages import ADDRESS as PLACER
from backbone.placer.messages import AskPlacement, NotPlaced, Placement
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import AskWhy, RequestState, UnknownRequest, Why

REPLY_TIME_S = 1.0  # chosen: a person waits this long

RULES = {
    "3": "each starts as early as it fits whole, and takes nothing from those before it",
    "5": "a slice ends only if somebody entitled can use the RCs",
    "6": "RCs are stopped and freed, then settle for the next one",
    "8": "policy strict: nobody starts while a higher one of its group waits",
    "9": "who is higher may keep others waiting for ever; that is allowed, and shown",
    "11": "what is down or can give too little serves nobody",
    "14": "who wants no time now keeps its request and frees its RCs",
    "15": "a big group is not planned whole: each RC is reserved for the first in line",
}
"""The rules of scheduling that decide why something is as it is, by the numbers they have in the documentation."""


@dataclass(frozen=True)
class Reasons:
    """Why something is as it is: its schedule, its place, its own words; at least one of them.

    Attributes:
        name: What was asked about.
        why: The RC manager's answer, if it knows the name.
        placement: The placer's answer, if it placed it.
        component: What the component says of itself, if there is one.
    """

    name: str
    why: Why | None
    placement: Placement | None
    component: ComponentState | None

    def lines(self, now_s: float) -> list[str]:
        """Return the reasons for people."""
        lines: list[str] = []
        if self.why is not None:
            lines += [f"{self.name}: {self.why.state}", *(f"  {line}" for line in self.why.lines)]
            if self.why.expected_start_s >= 0:
                lines.append(f"  expected to start in {max(0.0, self.why.expected_start_s - now_s):.1f} s")
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
        return lines

    def to_json(self) -> dict[str, Any]:
        """Return the reasons as plain data."""
        why, placement = self.why, self.placement
        return {
            "name": self.name,
            "why": {name: getattr(why, name) for name in why.__struct_fields__} if why else None,
            "placement": {name: getattr(placement, name) for name in placement.__struct_fields__}
            if placement
            else None,
        }


async def reasons_for(bus: Bus, name: str) -> Reasons:
    """Ask RC manager, placer and nameserver about the name.

    Raises:
        UnknownName: None of them knows it.
        LinkError: None of them answered.
    """
    why, placement, resolved = await asyncio.gather(
        _or_error(bus, RC_MANAGER, AskWhy(name), Why),
        _or_error(bus, PLACER, AskPlacement(name), Placement),
        _or_error(bus, NAMESERVER, Resolve(name), Resolved),
    )
    reasons = Reasons(
        name,
        why if isinstance(why, Why) else None,
        placement if isinstance(placement, Placement) else None,
        resolved.component if isinstance(resolved, Resolved) else None,
    )
    if reasons.why is None and reasons.placement is None and reasons.component is None:
        errors = (why, placement, resolved)
        raise next((e for e in errors if not isinstance(e, UnknownName | UnknownRequest | NotPlaced)), resolved)
    return reasons


async def story_of(bus: Bus, name: str) -> list[StoryEvent]:
    """Ask every component for the events about the name; return them in the order of their times."""
    listing = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
    stories = await asyncio.gather(
        *(_or_error(bus, c.address, _question(c.address, name), Story) for c in listing.components)
    )
    events = [event for story in stories if isinstance(story, Story) for event in story.events]
    return sorted(events, key=lambda event: event.at_s)


def _question(address: str, name: str) -> AskStory:
    """Ask the component itself for all it knows, the others for what is about it."""
    return AskStory() if address.endswith(f"/{name}") else AskStory(name)


async def _or_error(bus: Bus, address: str, question: Any, reply: type[Any]) -> Any:
    try:
        return await bus.ask(address, question, reply, within_s=REPLY_TIME_S)
    except (Refusal, LinkError) as error:
        return error
