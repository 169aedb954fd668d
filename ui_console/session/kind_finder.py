"""Kind finder: asks the mission for its kinds of ARC and their abilities."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from backbone.addresses import COMPONENT_DATABASE, DEPENDENCY_DATABASE
from backbone.component_database.messages import ComponentType, ListTypes, Types
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.errors import LinkError, Refusal
from ui_console.model.arc_abilities import ArcAbilities, arc_abilities
from ui_console.model.arc_kinds import NoArcKind, arc_kind
from ui_console.model.profile import Sight

if TYPE_CHECKING:
    from ui_console.session.claim import TeleoperationParameters
    from ui_console.session.observer import AnyObserver

ASK_AGAIN = "Take the robot again in a moment; 'scout-backbone status' names what is absent."

log = logging.getLogger(__name__)


class KindFinder:
    """Asks once for each claim, and keeps the newest answer for a claim of the same kind.

    Args:
        know: Called with the abilities of the claimed kind; None: not known yet.
    """

    def __init__(self, console: AnyObserver, know: Callable[[ArcAbilities | None], None]) -> None:
        self._console, self._know = console, know
        self._taken = ""
        self._known: tuple[str, ArcAbilities | None] = ("", None)
        self._is_new = False
        self._finding: asyncio.Task[None] | None = None

    @property
    def is_finding(self) -> bool:
        """True while a kind is sought."""
        return self._finding is not None and not self._finding.done()

    def begin(
        self,
        wished: TeleoperationParameters,
        found: Callable[[TeleoperationParameters, str], None],
        refused: Callable[[Refusal], None],
    ) -> None:
        """Ask for the kind of ARC for a wish, then call one of these functions; see ``arc_kind``."""

        async def find() -> None:
            try:
                kind = await self._find(wished.robot, wished.sight)
            except Refusal as refusal:
                refused(refusal)
                return
            self._finding = None
            found(wished, kind)

        self._finding = self._console.start_task(find(), "kind of ARC")

    def cancel(self) -> None:
        """Stop the search for a kind."""
        if self._finding is not None:
            self._finding.cancel()
            self._finding = None

    async def _find(self, robot: str, sight: Sight) -> str:
        try:
            types, resources = await asyncio.gather(self._ask_types(), self._ask_resources())
        except LinkError as error:
            raise NoArcKind(f"the kinds of ARC are not known: {error}", remedy=ASK_AGAIN) from error
        kind = arc_kind(robot, sight, types, resources)
        self._known, self._is_new = (kind, arc_abilities(kind, types, resources)), True
        return kind

    def take(self, kind: str) -> None:
        """Show the abilities of this kind, and ask again unless it was just found; do not wait."""
        before, abilities = self._known
        is_new, self._is_new, self._taken = self._is_new and before == kind, False, kind
        self._know(abilities if before == kind else None)
        if not is_new:
            self._console.start_task(self._ask_again(kind), "abilities")

    async def _ask_again(self, kind: str) -> None:
        types, resources = await asyncio.gather(self._ask_types(), self._ask_resources(), return_exceptions=True)
        for refused in (types, resources):
            if isinstance(refused, LinkError | Refusal):
                log.info("what %s can do is not wholly known: %s", kind, refused)
            elif isinstance(refused, BaseException):
                raise refused
        if kind == self._taken and not isinstance(types, BaseException):
            there = () if isinstance(resources, BaseException) else resources
            self._known = (kind, arc_abilities(kind, types, there))
            self._know(self._known[1])

    async def _ask_types(self) -> list[ComponentType]:
        answer = await self._console.ask_core(COMPONENT_DATABASE, ListTypes(), Types)
        return [one.component_type for one in answer.types]

    async def _ask_resources(self) -> list[Resource]:
        return (await self._console.ask_core(DEPENDENCY_DATABASE, AskResources(), Resources)).resources
