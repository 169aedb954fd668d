"""Settings of clients and hubs: authentication only where there is a secret, and other hubs are dialed for ever."""

from __future__ import annotations

from typing import Any

import pytest

from backbone.bus.zenoh_settings import client_settings, hub_settings


def test_a_client_proves_a_secret_only_if_it_has_one() -> None:
    without: Any = client_settings("tcp/192.0.2.7:7447")
    assert without["transport"]["auth"] == {}
    proving: Any = client_settings("tcp/192.0.2.7:7447", "c0ffee")
    assert proving["transport"]["auth"]["usrpwd"] == {"user": "scout", "password": "c0ffee"}


@pytest.mark.parametrize("dictionary_file", ["", "/run/secret"])
def test_a_hub_authenticates_its_clients_only_by_a_file(dictionary_file: str) -> None:
    settings: Any = hub_settings(["tcp/192.0.2.7:7447"], [], dictionary_file)
    assert settings["transport"]["auth"].get("usrpwd", {}).get("dictionary_file", "") == dictionary_file


def test_a_hub_dials_other_hubs_for_ever_and_a_client_gives_up() -> None:
    hub: Any = hub_settings([], ["tcp/192.0.2.8:7447"], "")
    assert (hub["connect"]["timeout_ms"], hub["connect"]["exit_on_failure"]) == (-1, False)
    client: Any = client_settings("tcp/192.0.2.8:7447")
    assert client["connect"]["timeout_ms"] > 0
    assert client["connect"]["exit_on_failure"]
    assert "connect" not in hub_settings(["tcp/192.0.2.7:7447"], [], "")


def test_nothing_is_looked_for_on_the_network() -> None:
    for settings in (client_settings("tcp/192.0.2.7:7447"), hub_settings([], [], "")):
        scouting: Any = settings["scouting"]
        assert not scouting["multicast"]["enabled"]
        assert not scouting["gossip"]["enabled"]
