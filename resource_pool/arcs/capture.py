"""ARC kind 3: drive a robot that broadcasts video, and capture it for processing.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import ClassVar

from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRequest, CloseGate, OpenGate, TakePath
from backbone.wire import Accepts, Envelope, Message
from resource_pool.arcs.video_drive import VideoDriveArc
from resource_pool.commands import Tune
from resource_pool.messages import Accepted, ArcQuestion, NotFromYou, NothingHeard


class CaptureArc(VideoDriveArc):
    """A robot, its radio and video frequency, and a framegrabber tuned to it; frames go out under its address."""

    roles: ClassVar[Sequence[str]] = (*VideoDriveArc.roles, "framegrabber")
    receiver: ClassVar[str] = "framegrabber"
    """Role of the RC that receives and delivers."""
    gives_pictures = True
    accepts: ClassVar[Accepts | None] = OpenGate | CloseGate | AskRequest | TakePath | ArcQuestion | NothingHeard

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Switch the transmitter on and tune, at the same time."""
        tune = Tune(self.rc("video_frequency"), self.rc(self.body))
        tuning = self.tell_rc(self.receiver, epochs[self.rc(self.receiver)], tune)
        await asyncio.gather(super().prepare(epochs), tuning)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the receiver, too: switch on a transmitter that it does not receive."""
        match asked.body:
            case NothingHeard(rc=rc, epoch=epoch):
                receiver = self.rc(self.receiver)
                if asked.source != address(Subsystem.RESOURCE_POOL, receiver) or rc != receiver:
                    raise NotFromYou(f"{self.name} hears from {receiver} what is on the air, not from {asked.source}")
                if self.epochs.get(receiver) == epoch:
                    self.story.note(self.name, f"{receiver} hears nothing: the transmitter is switched on again")
                    await super().prepare(self.epochs)
                return Accepted()
            case _:
                return await super().answer(asked)
