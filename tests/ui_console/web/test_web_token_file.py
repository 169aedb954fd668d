"""A server that begins again lets the pages in that its forerunner let in."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ui_console.web.door import Doorkeeper, Pass, passes_for
from ui_console.web.token_file import TokenFile, TokensNotKept, kept_or_new

ANNA, BEN = Pass("anna", 120), Pass("ben", 80)
operators = st.dictionaries(st.sampled_from(["anna", "ben", "carla"]), st.integers(0, 200))


@given(operators, operators)
def test_who_had_a_token_has_the_same_with_the_priority_of_now(before: dict[str, int], now: dict[str, int]) -> None:
    earlier, new = passes_for(before.items(), 50), passes_for(now.items(), 60)
    kept = kept_or_new(new, earlier)
    assert sorted(kept.values(), key=str) == sorted(new.values(), key=str), "nobody more, nobody less"
    tokens = {granted.user: token for token, granted in earlier.items()}
    for token, granted in kept.items():
        assert token == tokens.get(granted.user, token)


def test_a_restarted_server_opens_with_the_tokens_of_its_forerunner(tmp_path: Path) -> None:
    first = kept_or_new({"one": ANNA, "two": BEN}, TokenFile(tmp_path, 8420).read())
    TokenFile(tmp_path, 8420).keep(first)
    second = kept_or_new({"three": ANNA}, TokenFile(tmp_path, 8420).read())
    assert Doorkeeper(second).open_with("one") == ANNA
    assert Doorkeeper(second).open_with("two") is None, "ben is not served any more"
    assert TokenFile(tmp_path, 8421).read() == {}, "another port is another server"


def test_nobody_else_can_read_the_tokens(tmp_path: Path) -> None:
    file = TokenFile(tmp_path, 8420)
    before = os.umask(0)
    try:
        file.keep({"one": ANNA})
    finally:
        os.umask(before)
    assert stat.S_IMODE(file.path.stat().st_mode) == 0o600
    assert [path.name for path in tmp_path.iterdir()] == [file.path.name]


def test_tokens_that_somebody_else_could_read_open_nothing(tmp_path: Path) -> None:
    file = TokenFile(tmp_path, 8420)
    file.keep({"one": ANNA})
    file.path.chmod(0o644)
    assert file.read() == {}
    file.keep({"one": ANNA})
    assert file.read() == {"one": ANNA}
    other = tmp_path / "other.json"
    file.path.rename(other)
    file.path.symlink_to(other)
    assert file.read() == {}


@pytest.mark.parametrize("content", [b"", b"{", b'{"a": 1}', b"[]"])
def test_what_is_no_token_file_opens_nothing(tmp_path: Path, content: bytes) -> None:
    file = TokenFile(tmp_path, 8420)
    file.keep({})
    file.path.write_bytes(content)
    assert file.read() == {}


def test_where_nothing_can_be_written_it_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(TokensNotKept, match="gone"):
        TokenFile(tmp_path / "gone", 8420).keep({"one": ANNA})
