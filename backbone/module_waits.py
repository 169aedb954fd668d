"""What a module of an execution unit waits for: the question, and the unit's answer."""

from __future__ import annotations

from typing import Annotated

import msgspec

from backbone.ranges import FEW, Count, Instant, Mention
from backbone.wire import Message


class AskModule(Message, frozen=True):
    """Ask a unit what one of its modules waits for."""

    module: Mention


class AwaitedInput(msgspec.Struct, frozen=True):
    """An input without which a module does not run.

    Attributes:
        source: Address under which its values are published, or the name of the module of the same unit that produces
            them.
        has_come: True: the module has had an earlier value and waits for a new one.
        is_late: True: no value has come within the deadline of its quality.
    """

    key: Mention
    source: Mention
    has_come: bool
    is_late: bool


class ModuleWaits(Message, frozen=True):
    """Answer to ``AskModule``.

    Attributes:
        runs: Number of its runs.
        awaited: Inputs that it waits for at present; empty: it runs in the unit's next round.
        needs_all: True: it needs all of them; False: one of them is enough.
        computes_since_s: Mission time of the round in which its ``update`` runs at present; None: it does not run.
    """

    runs: Count
    awaited: Annotated[list[AwaitedInput], FEW]
    needs_all: bool
    computes_since_s: Instant | None = None
