"""The page: files of this package, each with what a browser must know to trust nothing else.

Rules of this file: no socket; a path goes in, what to answer comes out. Files are read once and named, so no path leads
anywhere else.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from urllib.parse import urlsplit

FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/console.css": ("console.css", "text/css; charset=utf-8"),
    "/main.js": ("main.js", "text/javascript; charset=utf-8"),
    "/link.js": ("link.js", "text/javascript; charset=utf-8"),
    "/login.js": ("login.js", "text/javascript; charset=utf-8"),
    "/driving.js": ("driving.js", "text/javascript; charset=utf-8"),
    "/pictures.js": ("pictures.js", "text/javascript; charset=utf-8"),
    "/tables.js": ("tables.js", "text/javascript; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
DESIGN_FILES = {
    "/": ("design.html", "text/html; charset=utf-8"),
    "/console.css": ("console.css", "text/css; charset=utf-8"),
    "/design.css": ("design.css", "text/css; charset=utf-8"),
    "/link.js": ("link.js", "text/javascript; charset=utf-8"),
    "/login.js": ("login.js", "text/javascript; charset=utf-8"),
    "/design.js": ("design.js", "text/javascript; charset=utf-8"),
    "/design_tree.js": ("design_tree.js", "text/javascript; charset=utf-8"),
    "/design_drag.js": ("design_drag.js", "text/javascript; charset=utf-8"),
    "/design_panels.js": ("design_panels.js", "text/javascript; charset=utf-8"),
    "/design_dialogs.js": ("design_dialogs.js", "text/javascript; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
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
"""Nothing from elsewhere, nothing inline, in nobody's frame; asked for anew each time, so no old page is shown."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What to answer to a request for a file."""

    status: int
    headers: dict[str, str]
    body: bytes


class Site:
    """The files of a page, read from the package.

    Args:
        files: Path of the address → name of the file and its type.
    """

    def __init__(self, files: Mapping[str, tuple[str, str]] = FILES) -> None:
        folder = resources.files("ui_console.web").joinpath("page")
        self._answers: dict[str, Answer] = {}
        for path, (name, kind) in files.items():
            body = folder.joinpath(name).read_bytes()
            tag = f'"{hashlib.sha256(body).hexdigest()[:16]}"'
            self._answers[path] = Answer(200, {**SAFETY, "Content-Type": kind, "ETag": tag}, body)

    def answer(self, path: str, known_tag: str = "") -> Answer:
        """Return what to answer to a GET.

        Args:
            path: As asked for, with query.
            known_tag: ``If-None-Match`` of the request.
        """
        found = self._answers.get(path.partition("?")[0])
        if found is None:
            return Answer(404, {**SAFETY, "Content-Type": "text/plain; charset=utf-8"}, b"There is no such page.\n")
        if known_tag == found.headers["ETag"]:
            return Answer(304, found.headers, b"")
        return found


def is_own_page(origin: str, host: str) -> bool:
    """Say whether a connection comes from this server's page, or from no page at all.

    Args:
        origin: ``Origin`` of the request; empty: a program, which needs the token like everybody.
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
