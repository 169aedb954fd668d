"""Settings of clients and hubs: authentication only where there is a secret, other hubs dialed for ever, and leases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from backbone.authentication import socket_endpoint
from backbone.bus.zenoh_outlets import on_the_wire
from backbone.bus.zenoh_settings import (
    HOST_BATCH_BYTES,
    HOST_LEASE_MS,
    LINK_LEASE_MS,
    client_settings,
    hub_settings,
)
from backbone.creator.messages import RestartPolicy
from backbone.creator.silence import SHOWN_AFTER_S
from backbone.quality import Quality, Urgency

NARROW_BIT_S = 256e3  # the narrowest link of docs/how-to/run-on-several-hosts.md


def test_a_client_proves_a_secret_only_if_it_has_one() -> None:
    without: Any = client_settings("tcp/192.0.2.7:7447")
    assert without["transport"]["auth"] == {}
    proving: Any = client_settings("tcp/192.0.2.7:7447", "c0ffee")
    assert proving["transport"]["auth"]["usrpwd"] == {"user": "scout", "password": "c0ffee"}


@pytest.mark.parametrize("dictionary_file", ["", "/run/secret"])
def test_a_hub_authenticates_its_clients_only_by_a_file(dictionary_file: str) -> None:
    settings: Any = hub_settings(["tcp/192.0.2.7:7447"], dictionary_file)
    assert settings["transport"]["auth"].get("usrpwd", {}).get("dictionary_file", "") == dictionary_file


def test_a_client_gives_up_and_a_hub_dials_nobody() -> None:
    client: Any = client_settings("tcp/192.0.2.8:7447")
    assert client["connect"]["timeout_ms"] > 0
    assert client["connect"]["exit_on_failure"]
    assert "connect" not in hub_settings(["tcp/192.0.2.7:7447"], "")


def test_nothing_is_looked_for_on_the_network() -> None:
    for settings in (client_settings("tcp/192.0.2.7:7447"), hub_settings([], "")):
        scouting: Any = settings["scouting"]
        assert not scouting["multicast"]["enabled"]
        assert not scouting["gossip"]["enabled"]


def lease_ms(settings: Any) -> int:
    link = settings["transport"]["link"]["tx"]
    return int(link["lease"])


def test_a_link_that_can_be_cut_is_given_up_soon_and_one_that_cannot_is_kept_alive_rarely() -> None:
    socket, port = socket_endpoint(Path("/run")), "tcp/192.0.2.7:7447"
    assert lease_ms(client_settings(socket)) == lease_ms(hub_settings([socket], "")) == HOST_LEASE_MS
    of_several_hosts = [client_settings(port), hub_settings([socket, port], "")]
    assert {lease_ms(settings) for settings in of_several_hosts} == {LINK_LEASE_MS}


def test_a_batch_passes_a_narrow_link_well_within_its_lease() -> None:
    """The receiver notices a batch only when all of it has come; the smaller batches of the two ends are used."""
    client: Any = client_settings("tcp/192.0.2.7:7447")
    batch_s = 8 * client["transport"]["link"]["tx"]["batch_size"] / NARROW_BIT_S
    assert batch_s < lease_ms(client) / 1000 / 3


def test_a_burst_finds_as_much_room_at_a_link_as_on_a_host() -> None:
    """Else copies for recorders and pictures are dropped whenever a busy machine pauses a link for a moment."""
    client: Any = client_settings("tcp/192.0.2.7:7447")
    tx = client["transport"]["link"]["tx"]
    for urgency in Urgency:
        for is_reliable in (True, False):
            queue = str(on_the_wire(Quality(urgency=urgency, reliable=is_reliable))["priority"]).rpartition(".")[2]
            assert tx["queue"]["size"][queue.lower()] * tx["batch_size"] >= 2 * HOST_BATCH_BYTES, queue


def test_a_hung_process_is_replaced_before_its_link_is_given_up() -> None:
    assert RestartPolicy().hung_after_s + SHOWN_AFTER_S < HOST_LEASE_MS / 1000
