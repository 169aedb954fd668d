"""Watches debug views: finds the behaviors that have views, and renews the lease on the watched view."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.interface import Bus, Clock
from backbone.debug_views import (
    LOOK_AGAIN_S,
    ListViews,
    LookAt,
    LookedAt,
    UnknownView,
    ViewPicture,
    Views,
    ViewValue,
    view_address,
)
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.naming import Subsystem
from backbone.placer.messages import AskPlacement, Placement
from backbone.wire import Envelope, UnknownMessage
from ui_console.model.message_views import PixelPicture

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: a person waits this long; machine seconds


class NoViews(Refusal):
    """The component is not a behavior, so it has no debug views."""

    code = "views.no_behavior"
    remedy = "Name a behavior; 'scout-backbone tree' shows the behaviors of the mission file."


async def find_behavior(bus: Bus, name: str) -> str:
    """Return the address of the behavior of this name.

    Raises:
        Refusal: There is no such component, it does not run now, or it is not a behavior.
        LinkError: The nameserver did not answer.
    """
    try:
        found = (await bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)).component
    except UnknownName as unknown:
        raise await _not_now(bus, name, unknown) from None
    if not found.address.startswith(f"{Subsystem.MISSION_CONTROL}/"):
        raise NoViews(f"{name} is a {found.type}, no behavior")
    return found.address


async def _not_now(bus: Bus, name: str, unknown: UnknownName) -> UnknownName:
    """Return the refusal, with other words if the placer wants this component, so it is absent for a while."""
    try:
        await bus.ask(PLACER, AskPlacement(name), Placement, within_s=REPLY_TIME_S)
    except (Refusal, LinkError):
        return unknown
    remedy = f"'scout-backbone why {name}' says why; try again."
    return UnknownName(f"{name} does not run now", remedy=remedy, name=name)


async def views_of(bus: Bus, behavior: str) -> Views:
    """Return the views that a behavior has shown so far, with their newest values.

    Args:
        behavior: Its address.

    Raises:
        NoViews: The component does not support debug views.
        LinkError: It did not answer.
    """
    try:
        return await bus.ask(behavior, ListViews(), Views, within_s=REPLY_TIME_S)
    except UnknownMessage as unknown:
        raise NoViews(f"{behavior} has no debug views") from unknown


async def all_views(bus: Bus) -> dict[str, Views]:
    """Return address and views of each behavior that answered and has views, sorted by address.

    Raises:
        LinkError: The nameserver did not answer.
    """
    question = ListComponents(subsystem=str(Subsystem.MISSION_CONTROL))
    there = (await bus.ask(NAMESERVER, question, Components, within_s=REPLY_TIME_S)).components
    addresses = [one.address for one in there]
    answers = await asyncio.gather(*(views_of(bus, one) for one in addresses), return_exceptions=True)
    found = dict[str, Views]()
    for address, answer in zip(addresses, answers, strict=True):
        if isinstance(answer, Views):
            found |= {address: answer} if answer.views else {}
        elif isinstance(answer, Refusal | LinkError):
            log.info("%s did not answer with its views: %s", address, answer)
        else:
            raise answer
    return found


async def keep_looking(
    bus: Bus,
    clock: Clock,
    behavior: str,
    view: str,
    show: Callable[[ViewPicture | ViewValue], None],
    *,
    trouble: Callable[[Refusal | LinkError], None] = lambda _error: None,
) -> None:
    """Watch a view until cancelled; the behavior may end and restart meanwhile.

    Args:
        clock: The mission's.
        behavior: Its address.
        show: Called in the event loop with each picture or value.
        trouble: Called at each renewal for which the behavior does not answer or has not shown the view again.

    Raises:
        Refusal: The first answer is a refusal.
        LinkError: There was no first answer.
    """

    def heard(envelope: Envelope[ViewPicture | ViewValue]) -> None:
        show(envelope.body)

    kinds = ViewPicture | ViewValue
    at = view_address(behavior, view)
    hearing = bus.subscribe(at, Conversation.VIEWS, kinds, heard, latest=True)  # type: ignore[arg-type]
    try:
        await bus.ask(behavior, LookAt(view), LookedAt, within_s=REPLY_TIME_S)
        while True:
            await clock.sleep_s(LOOK_AGAIN_S * clock.rate)
            try:
                await bus.ask(behavior, LookAt(view), LookedAt, within_s=REPLY_TIME_S)
            except (UnknownView, LinkError) as error:
                trouble(error)
    finally:
        hearing.close()


def pixels_of(picture: ViewPicture | PixelPicture) -> NDArray[np.uint8]:
    """Return grey levels of shape (height, width), or red, green and blue of shape (height, width, 3).

    Raises:
        ValueError: There are too few or too many pixels.
    """
    shape = (picture.height_px, picture.width_px, 3) if picture.is_color else (picture.height_px, picture.width_px)
    return np.frombuffer(picture.pixels, np.uint8).reshape(shape)
