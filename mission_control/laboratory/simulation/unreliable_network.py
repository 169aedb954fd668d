"""A network inside one process with lost, late and doubled messages.

Rules of this file:

* A link keeps the order of messages, as a TCP connection does: messages after a late message arrive after it. A doubled
  message arrives twice in a row.
* A question and its answer have separate faults. The requester cannot know which of them was lost.
* A component that is cut off neither receives nor sends messages; when the cut ends, all waiting messages are
  delivered.
* Messages to and from the placer always arrive, because the placer is simulated and no law concerns it.
* The appearance and withdrawal of liveliness tokens may be late, but are never lost, because a hub keeps tokens.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from backbone.addresses import PLACER
from backbone.bus.local_bus import Answered, LocalNetwork
from backbone.bus.neighbor_declarations import Listening, Watching
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.faults import Fates, MessageFault

ORDER_STEP_S = 1e-6  # chosen: far below every meaningful time, far above the loop's resolution


class UnreliableNetwork(LocalNetwork):
    """See the rules of this file.

    Args:
        mission: Name of the mission; each mission has its own network.
        fates: Decides the fault of each message.
        begin_s: Mission time from which messages have faults.
        end_s: Mission time from which all messages arrive again.
    """

    def __init__(self, mission: str, fates: Fates, begin_s: float, end_s: float) -> None:
        super().__init__(mission)
        self.suffered: list[MessageFault] = []
        self._fates, self._begin_s, self._end_s = fates, begin_s, end_s
        self._said: Counter[str] = Counter()
        self._cut_until_s: dict[str, float] = {}
        self._link_free_s: dict[tuple[str, str], float] = {}

    def cut_off(self, address: str, until_s: float) -> None:
        """Stop all messages to and from this address until this time."""
        self._cut_until_s[address] = max(until_s, self._cut_until_s.get(address, 0.0))

    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Deliver question and answer, each with its own fault."""
        source = asked.source
        fault = self._fault(source, address, type(asked.body).__name__)

        def travel_back(outcome: Envelope[Message] | None) -> None:
            if outcome is None:  # the component died meanwhile; the loss of its link reports that
                answered(None)
                return
            name = f"answer {type(outcome.body).__name__}"
            back = self._fault(address, source, name)
            self._travel(address, source, back, lambda: answered(outcome))

        def ask(tell: Answered) -> None:
            LocalNetwork.carry_question(self, address, asked, tell)

        if fault is None and not self._is_slow(source, address):
            ask(travel_back)
            return
        self._travel(source, address, fault, lambda: ask(travel_back))
        if fault is not None and fault.effect == "doubled":
            self._travel(source, address, None, lambda: ask(lambda _outcome: None))

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        """Deliver the publication to this listener, with its fault."""
        source, target = envelope.source, listening.owner.source
        fault = self._fault(source, target, type(envelope.body).__name__)
        self._travel(source, target, fault, lambda: listening.deliver(address, envelope))
        if fault is not None and fault.effect == "doubled":
            self._travel(source, target, None, lambda: listening.deliver(address, envelope))

    def carry_life(self, watching: Watching, address: str, alive: bool) -> None:
        """Deliver the change of a token; to a component that is cut off, late."""
        self._travel("", watching.owner.source, None, lambda: watching.notify(address, alive))

    def _fault(self, source: str, target: str, name: str) -> MessageFault | None:
        if not self._begin_s <= asyncio.get_running_loop().time() < self._end_s:
            return None
        if source == target or PLACER in (source, target):
            return None
        kind = f"{source} > {target} {name}"
        self._said[kind] += 1
        fault = self._fates.fate(f"{kind} {self._said[kind]}")
        if fault is not None:
            self.suffered.append(fault)
        return fault

    def _is_slow(self, source: str, target: str) -> bool:
        return self._free_s(source, target) > asyncio.get_running_loop().time()

    def _free_s(self, source: str, target: str) -> float:
        return max(
            self._link_free_s.get((source, target), 0.0),
            self._cut_until_s.get(source, 0.0),
            self._cut_until_s.get(target, 0.0),
        )

    def _travel(self, source: str, target: str, fault: MessageFault | None, arrive: Callable[[], None]) -> None:
        """Deliver a message after all earlier messages of this link."""
        if fault is not None and fault.effect == "lost":
            return
        loop = asyncio.get_running_loop()
        by_s = fault.by_s if fault is not None else 0.0
        at_s = max(loop.time() + by_s, self._free_s(source, target))
        if at_s <= loop.time():
            arrive()
            return
        self._link_free_s[source, target] = at_s + ORDER_STEP_S
        loop.call_at(at_s, arrive)
