"""A mission file and the people who design it in their browsers: they share the draft, and each has a cursor.

``changes`` decides the effect of a change. The room carries out one change at a time, shows it to all pages, and stores
the draft beside the file.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import assert_never

import msgspec

from backbone.errors import Refusal
from backbone.mission.class_facts import ClassFacts, shipped_classes
from backbone.mission.edit import Path, outline
from backbone.mission.reader import MissionInvalid
from ui_console.design.answers import AskAnswer, FileChangedAnswer, NoticeAnswer, RefusalAnswer, SavedAnswer, TextAnswer
from ui_console.design.catalogue import entries
from ui_console.design.changes import ChangedMeanwhile, MustAsk, changed, sections, sibling_file, touched_by
from ui_console.design.commands import DesignRefused
from ui_console.design.draft import Draft
from ui_console.design.file import FileChanged, save
from ui_console.design.following import follower
from ui_console.design.keeping import DraftFile, DraftNotKept
from ui_console.design.protocol import (
    Change,
    DesignIntent,
    LookUp,
    MoveElement,
    ReadText,
    Redo,
    Rehearse,
    RemoveElement,
    SaveFile,
    Select,
    SetProperty,
    TakeFile,
    TakeOffer,
    Undo,
)
from ui_console.design.views import (
    DesignerWelcomed,
    RehearsalView,
    element_view,
    offer_view,
    rehearsal_view,
    status_view,
)
from ui_console.web.login import ProtocolViolation, Welcome
from ui_console.web.page_client import PageClient

log = logging.getLogger(__name__)

LookUpClasses = Callable[[Sequence[str]], Awaitable[dict[str, ClassFacts]]]


class Designer(PageClient):
    """A person at a page of the designer."""

    def __init__(self, welcome: Welcome) -> None:
        super().__init__(welcome)
        self.at: Path = ()
        """The element shown to this person."""
        self.selected = 0
        """The page's number of its last choice."""
        self.sees_rehearsal = False
        self.handled = 0
        """Number of changes carried out or refused; the page sends one change at a time."""

    def show(self, name: str, view: object) -> None:
        """Queue a section of the view."""
        self.put(name, msgspec.json.encode(view))


class DesignRoom:
    """Serves any number of designers of one file.

    Args:
        kept: The draft file, until the draft is saved.
        look_up: Asks classes for their documentation and parameters, see ``serving.look_up``.
    """

    def __init__(self, draft: Draft, kept: DraftFile, look_up: LookUpClasses) -> None:
        self.draft = draft
        self.revision = 1
        self.clients: dict[Designer, None] = {}
        self._kept, self._look_up = kept, look_up
        self._facts = dict(shipped_classes())
        self._trusted = _classes_of(draft.saved)
        self._turn, self._disk = asyncio.Lock(), asyncio.Lock()
        self._sections: dict[str, bytes] = {}
        self._rehearsal: tuple[int, RehearsalView | None] = (0, None)
        self._to_keep = asyncio.Event()
        self._keeping: asyncio.Task[None] | None = None
        self._changed_by = ""

    def enter(self, welcome: Welcome) -> Designer:
        """Return a new designer, whose page gets the whole view."""
        client = Designer(welcome)
        self.clients[client] = None
        client.show("welcome", DesignerWelcomed(welcome.user))
        if self._sections:
            self._send(client)
        self._send_people()
        return client

    async def leave(self, client: Designer, reason: str) -> None:
        """Remove a designer; the draft stays."""
        self.clients.pop(client, None)
        log.info("%s left: %s", client.welcome.user, reason)
        self._send_people()

    def refused(self, client: Designer) -> None:
        """Do nothing, because a designer has no actions in progress."""

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the designers a violation."""
        log.warning("%s %s", who, violation.line)
        for client in self.clients:
            client.answer(NoticeAnswer(f"{who} {violation.line}", violation.remedy))

    async def obey(self, client: Designer, intent: DesignIntent) -> None:
        """Carry out a designer's messages one after the other; send refusals to that designer."""
        is_change = isinstance(intent, Change | SaveFile | TakeFile)
        try:
            async with self._turn:
                await self._do(client, intent)
        except MustAsk as must:
            if isinstance(intent, TakeOffer):
                client.answer(AskAnswer(offer_view(must.offer), intent.path))
        except FileChanged as refusal:
            client.answer(FileChangedAnswer(refusal.detail, intent.name if isinstance(intent, SaveFile) else ""))
        except MissionInvalid as invalid:
            client.answer(RefusalAnswer(str(invalid.faults[0]), "Mend the file, or save over it.", is_change))
        except Refusal as refusal:
            client.answer(RefusalAnswer(refusal.detail, refusal.remedy, is_change))
        if is_change:
            client.handled += 1
            client.show("handled", client.handled)

    async def _do(self, client: Designer, intent: DesignIntent) -> None:
        match intent:
            case Select(path=path, number=number):
                client.at, client.selected = self.draft.mission.nearest(path), number
                self._send_element(client)
            case TakeOffer() | SetProperty() | MoveElement() | RemoveElement() | Undo() | Redo():
                await self._change(client, intent)
            case SaveFile():
                await self._save(client, intent)
            case TakeFile(revision=revision):
                self._must_be(revision)
                opened = await asyncio.to_thread(Draft.opened, self.draft.source)
                await self._show(self.draft.taken_from(opened.text), client.welcome.user)
            case Rehearse(is_shown=is_shown):
                client.sees_rehearsal = is_shown
                await self._rehearse()
            case LookUp(type=name):
                await self._learn_type(name)
            case ReadText():
                text, line = self.draft.text.decode("utf-8-sig"), self.draft.mission.at(client.at).place.line
                client.answer(TextAnswer(text, line, self.draft.source))
            case _:
                assert_never(intent)

    async def _change(self, client: Designer, change: Change) -> None:
        self._must_be(change.revision)
        before = self.draft
        after = await asyncio.to_thread(changed, before, change)
        if after is before:
            return
        await self._show(after, client.welcome.user, (client, touched_by(change, before, after)))

    async def _save(self, client: Designer, intent: SaveFile) -> None:
        self._must_be(intent.revision)
        before = self.draft.source
        path = sibling_file(before, intent.name)
        kept = await asyncio.to_thread(save, self.draft, path, overwrite=intent.overwrite)
        await self._show(kept, client.welcome.user)
        await self._keep()
        if kept.source != before:
            self._kept = DraftFile(kept.source)
            await self._keep()
        client.answer(SavedAnswer(kept.source, len(kept.problems)))

    def _must_be(self, revision: int) -> None:
        if revision != self.revision:
            by = f" by {self._changed_by}" if self._changed_by else ""
            raise ChangedMeanwhile(f"the mission was changed{by} meanwhile")

    async def _learn_type(self, name: str) -> None:
        entry = next((one for one in entries(self.draft.mission) if one.name == name), None)
        if entry is None:
            raise DesignRefused(f"there is no type {name!r}")
        if not entry.is_stock and entry.class_path not in self._trusted:
            raise DesignRefused(
                f"{entry.class_path} was not in the file when this server began, and to look it up runs its code",
                remedy="Save the mission and start the server again.",
            )
        await self._learn([entry.class_path])

    async def prepare(self) -> None:
        """Create the sections of the first view."""
        async with self._turn:
            await self._show(self.draft, "")
        self._to_keep.clear()

    async def keep_on(self) -> None:
        """Write the draft file whenever the draft has changed; until cancelled. No change waits for the disk."""
        while True:
            await self._to_keep.wait()
            self._to_keep.clear()
            await self._keep()

    async def keep_now(self) -> None:
        """Write the draft file for the present draft; for an unchanged draft, remove it."""
        if self.revision > 1:
            await self._keep()

    async def _keep(self) -> None:
        async with self._disk:
            if self._keeping is not None:
                await asyncio.wait({self._keeping})  # its task continues if its caller was cancelled
            self._keeping = asyncio.create_task(asyncio.to_thread(self._kept.keep, self.draft), name="design: keep")
            try:
                await asyncio.shield(self._keeping)
            except DraftNotKept as refusal:
                log.warning("%s", refusal)
                for client in self.clients:
                    client.answer(NoticeAnswer(refusal.detail, refusal.remedy))

    async def _learn(self, class_paths: Sequence[str]) -> None:
        await self._known(await self._look_up(class_paths))

    async def _known(self, facts: dict[str, ClassFacts]) -> None:
        self._facts = {**self._facts, **facts}
        self.draft = self.draft.knowing(self._facts)
        self._sections = await asyncio.to_thread(sections, self.draft, self._facts)
        for client in self.clients:
            self._send(client)

    async def _show(self, draft: Draft, user: str, chosen: tuple[Designer, Path] | None = None) -> None:
        """Show this draft on all pages from now on; each cursor stays on its element.

        Args:
            user: Author of the change.
            chosen: The designer whose cursor moves, and its new element.
        """
        told = await asyncio.to_thread(sections, draft, self._facts)
        follow = await asyncio.to_thread(follower, self.draft, draft)
        self._to_keep.set()
        if draft is not self.draft:
            self.revision += 1
            self._changed_by = user
        self.draft, self._sections = draft, told
        for client in self.clients:
            client.at = chosen[1] if chosen is not None and client is chosen[0] else follow(client.at)
            self._send(client)
        await self._rehearse()

    async def _rehearse(self) -> None:
        watching = [client for client in self.clients if client.sees_rehearsal]
        if not watching:
            return
        if self._rehearsal[0] != self.revision:
            self._rehearsal = (self.revision, await asyncio.to_thread(_rehearsed, self.draft))
        for client in watching:
            client.show("rehearsal", self._rehearsal[1])

    def _send(self, client: Designer) -> None:
        for name, body in self._sections.items():
            client.put(name, body)
        client.show("status", status_view(self.draft, self.revision, self._changed_by))
        self._send_element(client)

    def _send_element(self, client: Designer) -> None:
        client.show("selected", client.selected)
        client.show("element", element_view(self.draft, client.at, self._facts))

    def _send_people(self) -> None:
        users = sorted(client.welcome.user for client in self.clients)
        for client in self.clients:
            client.show("people", users)


def _classes_of(saved: bytes | None) -> set[str]:
    """Return the classes that the mission file names; its author is trusted to run code here."""
    if saved is None:
        return set()
    try:
        return {one.class_path for one in entries(outline(saved))}
    except MissionInvalid:
        return set()


def _rehearsed(draft: Draft) -> RehearsalView | None:
    return None if draft.rehearsal is None else rehearsal_view(draft.rehearsal)
