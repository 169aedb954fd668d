"""A person at a page, as the server of pages sees them: an identity, and the messages for the page."""

from __future__ import annotations

import asyncio

import msgspec

from ui_console.web.login import Welcome
from ui_console.web.outbox import Outbox


class PageClient:
    """A person at a page, from authentication to the end of the connection.

    Args:
        welcome: Identity.
        former: The same person at the same page before; it keeps the page's messages. None: a new page.
    """

    def __init__(self, welcome: Welcome, former: PageClient | None = None) -> None:
        self.welcome = welcome
        self.outbox: Outbox = Outbox() if former is None else former.outbox
        """Messages not sent yet."""
        self.news: asyncio.Event = asyncio.Event() if former is None else former.news
        """Set when there is something to send."""

    def put(self, name: str, body: bytes) -> None:
        """Queue a section of the view, as JSON."""
        self.outbox.put_section(name, body)
        self.news.set()

    def answer(self, answer: object) -> None:
        """Queue an answer."""
        self.outbox.put_answer(msgspec.json.encode({"answer": answer}))
        self.news.set()

    def refuse(self, why: str) -> None:
        """Queue a refusal, for people."""
        self.answer({"refused": why})
