"""A network inside one process that can cut off single components; their messages arrive when the cut is healed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from backbone.bus.local_bus import Answered, LocalNetwork
from backbone.bus.neighbor_declarations import Listening
from backbone.errors import NoResponder
from backbone.wire import Envelope

Act = Callable[[], None]


class CutNetwork(LocalNetwork):
    """Keeps the messages of a component that is cut off until the cut is healed; tokens stand."""

    def __init__(self, mission: str) -> None:
        super().__init__(mission)
        self._kept: dict[str, list[Act]] = {}

    def cut(self, source: str) -> None:
        """Let nothing pass to or from this component."""
        self._kept.setdefault(source, [])

    def heal(self, source: str) -> None:
        """Let everything pass again, what was kept first."""
        for act in self._kept.pop(source, []):
            act()

    def carry_question(self, address: str, asked: Envelope[Any], answered: Answered) -> None:
        """Carry it there and the answer back, unless one of both is cut off."""

        def back(outcome: Envelope[Any] | None) -> None:
            self._pass([asked.source, address], lambda: answered(outcome))

        def ask() -> None:
            try:
                LocalNetwork.carry_question(self, address, asked, back)
            except NoResponder:
                back(None)

        self._pass([asked.source, address], ask)

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Any]) -> None:
        """Hand it over, unless one of both is cut off."""
        parties = [envelope.source, listening.owner.source]
        self._pass(parties, lambda: LocalNetwork.carry_publication(self, listening, address, envelope))

    def _pass(self, parties: list[str], act: Act) -> None:
        for party in parties:
            if party in self._kept:
                self._kept[party].append(lambda: self._pass(parties, act))
                return
        act()
