"""The page is complete, and trusts nothing from elsewhere."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

import cv2
import numpy as np
import pytest

from ui_console.web.page_files import DESIGN_FILES, FILES, PageFiles, is_own_page
from ui_console.web.pictures import jpeg, packet


def texts() -> dict[str, str]:
    folder = resources.files("ui_console.web").joinpath("page")
    return {name: folder.joinpath(name).read_text() for name, _kind in (*FILES.values(), *DESIGN_FILES.values())}


def test_every_file_of_the_page_is_served_with_its_safety() -> None:
    for files, path in [(page, path) for page in (FILES, DESIGN_FILES) for path in page]:
        answer = PageFiles(files).answer(path + "?x=1")
        assert answer.status == 200
        assert answer.body
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_a_page_the_browser_has_is_not_sent_again() -> None:
    site = PageFiles()
    tag = site.answer("/").headers["ETag"]
    assert (site.answer("/", tag).status, site.answer("/", tag).body) == (304, b"")
    assert site.answer("/", '"another"').status == 200


@pytest.mark.parametrize("path", ["/../cli.py", "/page/index.html", "//", "/index.html/..", "/%2e%2e/cli.py", ""])
def test_there_is_nothing_else(path: str) -> None:
    assert PageFiles().answer(path).status == 404


def test_nothing_comes_from_elsewhere_and_nothing_is_inline() -> None:
    for name, text in texts().items():
        found = re.findall(r"https?://[^\"'\s)]+", text)
        assert set(found) <= {"http://www.w3.org/2000/svg"}, name
    page = texts()["index.html"] + texts()["design.html"]
    assert not re.search(r"<script(?![^>]*\bsrc=)|\son\w+=|\sstyle=|<style", page)
    for name, text in texts().items():
        if name.endswith(".js"):
            assert not re.search(r"\beval\(|innerHTML|new Function|document\.write|insertAdjacentHTML", text), name


def test_files_of_the_pages_have_short_lines_and_few() -> None:
    for name, text in texts().items():
        lines = text.splitlines()
        assert not [line for line in lines if name.endswith(".js") and len(line) > 120], name
        assert len(lines) <= 400, name


def test_what_the_modules_look_for_is_on_the_page() -> None:
    for html, files in (("index.html", FILES), ("design.html", DESIGN_FILES)):
        ids = set(re.findall(r'id="([^"]+)"', texts()[html]))
        scripts = [name for name, _kind in files.values() if name.endswith(".js")]
        for name in scripts:
            assert set(re.findall(r'find\("([^"]+)"', texts()[name])) <= ids, name
            for module in re.findall(r'^[^*\n]*from "\./([^"]+)"', texts()[name], re.MULTILINE):
                assert f"/{module}" in files, name


@pytest.mark.parametrize("guide", ["operate-from-a-browser", "design-in-a-browser"])
def test_what_the_guides_quote_from_the_screen_is_written_there(guide: str) -> None:
    words = " ".join((Path(__file__).parents[3] / f"docs/how-to/{guide}.md").read_text().split())
    quoted = set(re.findall(r"(?<![*\w])\*([^*`]+)\*(?!\*)", words))
    screens = " ".join("".join(texts().values()).split())
    assert len(quoted) > 8
    assert [one for one in sorted(quoted) if one.replace("scout1", "${robot}") not in screens] == []


@pytest.mark.parametrize("html", ["index.html", "design.html"])
def test_everything_a_person_presses_has_a_name(html: str) -> None:
    page = texts()[html]
    assert '<html lang="en">' in page
    for attributes, label in re.findall(r"<button([^>]*)>([^<]*)</button>", page):
        assert label.strip() or "aria-label" in attributes
    for tag in re.findall(r"<input[^>]*>", page):
        at = page.index(tag)
        assert page.rfind("<label", 0, at) > page.rfind("</label>", 0, at), tag


@pytest.mark.parametrize(
    ("origin", "host", "is_own"),
    [
        ("", "127.0.0.1:8420", True),
        ("http://127.0.0.1:8420", "127.0.0.1:8420", True),
        ("https://robots.lab", "robots.lab", True),
        ("http://127.0.0.1:8421", "127.0.0.1:8420", False),
        ("http://evil.example", "127.0.0.1:8420", False),
        ("null", "127.0.0.1:8420", False),
        ("file://", "", False),
        ("http://[", "[", False),
    ],
)
def test_only_its_own_page_may_connect(origin: str, host: str, is_own: bool) -> None:
    assert is_own_page(origin, host) is is_own


def test_a_picture_arrives_as_it_was_but_for_little() -> None:
    rows, columns = np.mgrid[0:240, 0:320]
    picture = ((rows + columns) // 3).astype(np.uint8)
    packed = packet("scout1", 7, 1.5, jpeg(picture))
    assert packed[:7] == b"\x06scout1"
    assert int.from_bytes(packed[7:11], "big") == 7
    shown = cv2.imdecode(np.frombuffer(packed[19:], np.uint8), cv2.IMREAD_GRAYSCALE)
    assert shown.shape == (240, 320)
    assert np.abs(shown.astype(int) - picture).mean() < 2.0


@pytest.mark.parametrize("picture", [np.zeros((0, 3), np.uint8), np.zeros((2, 2, 4), np.uint8), np.zeros((2, 2))])
def test_what_is_no_picture_is_refused(picture: object) -> None:
    with pytest.raises(ValueError, match="grey levels"):
        jpeg(picture)  # type: ignore[arg-type]
