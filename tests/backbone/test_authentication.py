"""Where a hub listens, and the secret that it asks its clients for."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest
from free_ports import free_port

from backbone.authentication import (
    LONGEST_SOCKET_PATH,
    SOCKET_NAME,
    NoSecret,
    SocketPathCut,
    SocketPathTooLong,
    dictionary_of,
    keep_secret,
    new_secret,
    read_secret,
    read_secret_file,
    secret_of,
    socket_endpoint,
    tcp_endpoint,
)
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.component.launch import Launch
from backbone.errors import HubUnreachable
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem

CLOCK = MissionClock.started_now()


def folder_of_length(base: Path, length: int) -> Path:
    """Return a folder whose socket has a path of so many bytes."""
    missing = length - len(os.fsencode(base / "x" / SOCKET_NAME)) + 1
    folder = base / ("x" * missing)
    folder.mkdir()
    assert len(os.fsencode(folder / SOCKET_NAME)) == length
    return folder


def test_the_longest_socket_path_is_the_systems_and_one_byte_more_is_refused(short_path: Path) -> None:
    longest = folder_of_length(short_path, LONGEST_SOCKET_PATH)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(socket_endpoint(longest).removeprefix("unixsock-stream/"))
    longer = folder_of_length(short_path, LONGEST_SOCKET_PATH + 1)
    with pytest.raises(SocketPathTooLong, match="108 bytes"):
        socket_endpoint(longer)
    with socket.socket(socket.AF_UNIX) as listening, pytest.raises(OSError, match="too long"):
        listening.bind(str(longer / SOCKET_NAME))


@pytest.mark.parametrize("name", ["a?b", "a#b"])
def test_a_socket_path_that_zenoh_would_cut_is_refused(name: str) -> None:
    with pytest.raises(SocketPathCut, match="XDG_RUNTIME_DIR"):
        socket_endpoint(Path("/run") / name)


def test_the_secret_lies_in_a_file_that_others_cannot_read(tmp_path: Path) -> None:
    secret = new_secret()
    file = keep_secret(tmp_path, secret)
    assert file.stat().st_mode & 0o777 == 0o600
    assert (secret_of(str(tmp_path)), read_secret_file(file)) == (secret, secret)
    assert dictionary_of(str(tmp_path)) == str(file)
    keep_secret(tmp_path, "another")
    assert secret_of(str(tmp_path)) == "another"


def test_a_folder_without_a_secret_has_none(tmp_path: Path) -> None:
    assert (secret_of(str(tmp_path)), secret_of(""), dictionary_of(str(tmp_path)), dictionary_of("")) == ("",) * 4


@pytest.mark.parametrize("text", ["", "\n", "scout:", "two words", "a:b", "scout:a:b", "\x00", "a\nb"])
def test_what_is_no_secret_is_refused(text: str) -> None:
    with pytest.raises(NoSecret):
        read_secret(text)


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe", b"x" * 100 + b" y"])
def test_a_file_that_holds_no_secret_is_refused_by_its_name(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "secret").write_bytes(content)
        (tmp_path / "secret").chmod(0o600)
    with pytest.raises(NoSecret, match=str(tmp_path / "secret")) as refused:
        read_secret_file(tmp_path / "secret")
    assert "mode" not in refused.value.detail


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o644])
def test_a_file_that_other_accounts_may_read_is_refused_as_ssh_does(tmp_path: Path, mode: int) -> None:
    file = keep_secret(tmp_path, "word")
    file.chmod(mode)
    with pytest.raises(NoSecret, match=f"mode {mode:03o}") as refused:
        read_secret_file(file)
    assert f"chmod go= {file}" in refused.value.remedy
    file.chmod(0o400)
    assert read_secret_file(file) == "word"


async def test_a_hub_admits_clients_with_its_secret_at_both_endpoints(
    short_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("backbone.bus.zenoh_settings.OPEN_TIMEOUT_MS", 300)
    secret = new_secret()
    file = keep_secret(short_path, secret)
    endpoints = [socket_endpoint(short_path), tcp_endpoint("127.0.0.1", free_port())]
    hub = ZenohBus.open("m", "backbone/hub", CLOCK, hub_config(endpoints, dictionary_file=str(file)))
    try:
        for endpoint in endpoints:
            for wrong in ("", "c0ffee", secret[:-1]):
                with pytest.raises(HubUnreachable):
                    ZenohBus.open("m", "ui_console/x", CLOCK, client_config(endpoint, wrong))
            await ZenohBus.open("m", "ui_console/x", CLOCK, client_config(endpoint, secret)).close()
    finally:
        await hub.close()
    assert os.listdir(short_path) == ["secret"]


def test_a_hub_does_not_listen_for_other_machines_without_a_secret(short_path: Path) -> None:
    launch = Launch(
        "m",
        Subsystem.BACKBONE,
        "nameserver",
        "nameserver",
        "",
        "base",
        socket_endpoint(short_path),
        0.0,
        1.0,
        {"listen": [tcp_endpoint("127.0.0.1", free_port())]},
        run_directory=str(short_path),
    )
    with pytest.raises(NoSecret):
        Nameserver.open_bus(launch, CLOCK)
    assert list(short_path.iterdir()) == []
