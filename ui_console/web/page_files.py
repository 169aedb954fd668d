"""The page: files of this package, with headers that forbid the browser all other sources.

Rules of this file: no socket; a path goes in, an answer comes out. Only files that the page names are read, once, so no
path leads to another file.
"""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from urllib.parse import urlsplit

PAGE = resources.files("ui_console.web") / "page"
KINDS = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
}


_NAMED = re.compile(r'(?:src|href)="(\w+\.\w+)"|^[^*\n]*from "\./([^"]+)"', re.MULTILINE)


def _page(html: str) -> dict[str, tuple[str, str]]:
    """Return the files of a page by path, each with its type: those that it names or that its modules import."""
    names, found = [html], dict[str, str]()
    while names:
        name = names.pop()
        if name not in found:
            found[name] = KINDS[name.rpartition(".")[2]]
            names += filter(None, itertools.chain(*_NAMED.findall((PAGE / name).read_text("utf-8"))))
    return {"/" if name == html else f"/{name}": (name, kind) for name, kind in found.items()}


FILES, DESIGN_FILES = _page("index.html"), _page("design.html")
SOCKET_PATH = "/socket"

SAFETY = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
"""No content from other sites, no inline content, no framing; revalidation each time, so that no old page is shown."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a request for a file."""

    status: int
    headers: dict[str, str]
    body: bytes


class PageFiles:
    """The files of a page, read from the package.

    Args:
        files: Path of the address → name of the file and its type.
    """

    def __init__(self, files: Mapping[str, tuple[str, str]] = FILES) -> None:
        self._answers: dict[str, Answer] = {}
        for path, (name, kind) in files.items():
            body = (PAGE / name).read_bytes()
            tag = f'"{hashlib.sha256(body).hexdigest()[:16]}"'
            self._answers[path] = Answer(200, {**SAFETY, "Content-Type": kind, "ETag": tag}, body)

    def answer(self, path: str, known_tag: str = "") -> Answer:
        """Return the answer to a GET.

        Args:
            path: Path of the request, with query.
            known_tag: ``If-None-Match`` of the request.
        """
        found = self._answers.get(path.partition("?")[0])
        if found is None:
            return Answer(404, {**SAFETY, "Content-Type": "text/plain; charset=utf-8"}, b"There is no such page.\n")
        if known_tag == found.headers["ETag"]:
            return Answer(304, found.headers, b"")
        return found


def is_own_page(origin: str, host: str) -> bool:
    """Return whether a connection comes from this server's page, or not from a page.

    Args:
        origin: ``Origin`` of the request; empty: a program; it also needs the token.
        host: ``Host`` of the request.

    Example:
        >>> is_own_page("http://127.0.0.1:8420", "127.0.0.1:8420"), is_own_page("http://evil.example", "127.0.0.1:8420")
        (True, False)
    """
    if not origin:
        return True
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc == host
