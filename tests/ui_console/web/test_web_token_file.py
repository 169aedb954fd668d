"""A server that begins again lets the pages in that its forerunner let in."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone import run_files
from ui_console.web.login import Authenticator, TokenRights, new_rights
from ui_console.web.token_file import TokenFile, TokensNotKept, kept_or_new

ANNA, BEN = TokenRights("anna", 120), TokenRights("ben", 80)
operators = st.dictionaries(st.sampled_from(["anna", "ben", "carla"]), st.integers(0, 200))


@pytest.fixture
def private(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path_factory.mktemp("runtime")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    return folder


@given(operators, operators)
def test_who_had_a_token_has_the_same_with_the_priority_of_now(before: dict[str, int], now: dict[str, int]) -> None:
    earlier, new = new_rights(before.items(), 50), new_rights(now.items(), 60)
    kept = kept_or_new(new, earlier)
    assert sorted(kept.values(), key=str) == sorted(new.values(), key=str), "nobody more, nobody less"
    tokens = {granted.user: token for token, granted in earlier.items()}
    for token, granted in kept.items():
        assert token == tokens.get(granted.user, token)


def test_a_restarted_server_opens_with_the_tokens_of_its_forerunner(tmp_path: Path) -> None:
    first = kept_or_new({"one": ANNA, "two": BEN}, TokenFile(tmp_path, 8420).read())
    TokenFile(tmp_path, 8420).keep(first)
    second = kept_or_new({"three": ANNA}, TokenFile(tmp_path, 8420).read())
    assert Authenticator(second).rights_of("one") == ANNA
    assert Authenticator(second).rights_of("two") is None, "ben is not served any more"
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


@pytest.mark.parametrize("content", [b"", b"{", b'{"a": 1}', b"[]", b'{"\xff": {"user": "anna", "priority": 1}}'])
def test_what_is_no_token_file_opens_nothing(tmp_path: Path, content: bytes) -> None:
    file = TokenFile(tmp_path, 8420)
    file.keep({})
    file.path.write_bytes(content)
    assert file.read() == {}


def test_where_nothing_can_be_written_it_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(TokensNotKept, match="gone"):
        TokenFile(tmp_path / "gone", 8420).keep({"one": ANNA})


def test_tokens_of_a_mission_elsewhere_are_those_of_one_run_of_it(private: Path) -> None:
    here = ("lab", "tcp/10.0.0.1:7447", "secret of this run", 8420)
    TokenFile.of_mission_elsewhere(*here).keep({"one": ANNA})
    assert TokenFile.of_mission_elsewhere(*here).read() == {"one": ANNA}
    for other in (("lob", *here[1:]), (here[0], "tcp/10.0.0.2:7447", *here[2:]), (*here[:2], "of the next", 8420)):
        assert TokenFile.of_mission_elsewhere(*other).read() == {}
    [kept] = [path for path in private.rglob("*") if path.is_file()]
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600
    assert stat.S_IMODE(kept.parent.stat().st_mode) == 0o700
    assert "secret" not in str(kept)


def test_tokens_of_a_designer_are_those_of_its_file_however_it_is_named(
    private: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    TokenFile.of_design("mission.xml", 8420).keep({"one": ANNA})
    assert TokenFile.of_design(str(tmp_path / "mission.xml"), 8420).read() == {"one": ANNA}
    assert TokenFile.of_design("other.xml", 8420).read() == {}
    assert not any(tmp_path.glob("*.json")), "nothing lies beside a file that may be shared"


def test_what_is_kept_for_others_is_no_mission(private: Path) -> None:
    TokenFile.of_design("mission.xml", 8420).keep({"one": ANNA})
    assert run_files.find_all() == []
