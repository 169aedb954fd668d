"""A component for tests of real processes: it ends, stumbles or waits as its parameters say."""

from __future__ import annotations

from typing import Any

import msgspec

from backbone.component.component import Component
from backbone.wire import Envelope, Message


class Where(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Names the hook in which to stumble."""

    stumble: str = ""


class Stumble(Message, frozen=True):
    """Have a bug."""


class Plain(Component[Where]):
    """Registers nowhere, so no nameserver is needed."""

    parameters_type = Where
    accepts = Stumble
    registers = False

    async def serve(self) -> None:
        if self.parameters.stumble == "serve":
            raise KeyError("stumbled")

    async def drain(self) -> None:
        self.report("drained")

    async def answer(self, asked: Envelope[Any]) -> Message:
        raise KeyError("stumbled")
