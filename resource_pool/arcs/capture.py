"""ARC kind 3: drive a robot that broadcasts video, and capture it for processing.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import ClassVar

from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRequest, CloseGate, OpenGate
from backbone.wire import Accepts, Envelope, Message
from resource_pool.arcs.video_drive import VideoDriveArc
from resource_pool.commands import SwitchTransmitter, Tune
from resource_pool.messages import Accepted, ArcQuestion, NotFromYou, NothingHeard


class CaptureArc(VideoDriveArc):
    """A robot, its radio and video frequency, and a framegrabber tuned to it; frames go out under its address."""

    roles: ClassVar[Mapping[str, str] | Sequence[str]] = (*VideoDriveArc.roles, "framegrabber")
    receiver: ClassVar[str] = "framegrabber"
    """Role of the RC that receives and delivers pictures."""
    gives_pictures = True
    accepts: ClassVar[Accepts | None] = OpenGate | CloseGate | AskRequest | ArcQuestion | NothingHeard

    @classmethod
    def cameras(cls) -> Mapping[str, tuple[str, str]]:
        """Return role of each RC with a camera → roles of its video frequency and of its receiver.

        If a camera is not the ARC's body, its role is the last segment of the address of its pictures.
        """
        return {cls.body: ("video_frequency", cls.receiver)}

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Switch each transmitter on and tune its receiver, at the same time."""
        tuning = (self._tune(camera, *with_it, epochs) for camera, with_it in self.cameras().items())
        switching = (self._switch_on(camera, epochs) for camera in self.cameras())
        await asyncio.gather(*switching, *tuning)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Also answer the receivers: switch on the transmitter that a receiver reports as missing."""
        match asked.body:
            case NothingHeard(rc=rc, epoch=epoch):
                cameras = {self.rc(receiver): camera for camera, (_, receiver) in self.cameras().items()}
                if asked.source != address(Subsystem.RESOURCE_POOL, rc) or rc not in cameras:
                    heard = ", ".join(cameras)
                    raise NotFromYou(f"{self.name} hears from {heard} what is on the air, not from {asked.source}")
                if self.epochs.get(rc) == epoch:
                    self.story.note(self.name, f"{rc} hears nothing: the transmitter is switched on again")
                    await self._switch_on(cameras[rc], self.epochs)
                return Accepted()
            case _:
                return await super().answer(asked)

    async def _switch_on(self, camera: str, epochs: Mapping[str, int]) -> None:
        frequency, _ = self.cameras()[camera]
        await self.tell_rc(camera, epochs[self.rc(camera)], SwitchTransmitter(True, self.rc(frequency)))

    async def _tune(self, camera: str, frequency: str, receiver: str, epochs: Mapping[str, int]) -> None:
        tune = Tune(self.rc(frequency), self.rc(camera), "" if camera == self.body else camera)
        await self.tell_rc(receiver, epochs[self.rc(receiver)], tune)
