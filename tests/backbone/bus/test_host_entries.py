"""Entries of a host's folder: the last component that served an address is found there."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from backbone.bus.host_entries import FOLDER, Entry, HostEntries

ARC, FIRST, SECOND = "resource_pool/arc", Entry("5ocket", "scout/m/arc/asked/1"), Entry("50cket", "scout/m/arc/asked/2")


def test_an_entry_is_read_as_it_was_written_until_it_is_removed(tmp_path: Path) -> None:
    entries, others = HostEntries(tmp_path), HostEntries(tmp_path)
    assert others.read(ARC) is None
    entries.write(ARC, FIRST)
    assert others.read(ARC) == FIRST
    assert others.read("resource_pool/another") is None
    entries.remove(ARC, FIRST)
    assert others.read(ARC) is None
    assert list((tmp_path / FOLDER).iterdir()) == []


def test_a_component_that_ends_leaves_the_entry_of_its_successor(tmp_path: Path) -> None:
    entries = HostEntries(tmp_path)
    entries.write(ARC, FIRST)
    entries.write(ARC, SECOND)
    entries.remove(ARC, FIRST)
    assert entries.read(ARC) == SECOND


def test_no_address_leads_out_of_the_folder(tmp_path: Path) -> None:
    entries = HostEntries(tmp_path / "mission")
    (tmp_path / "mission").mkdir()
    entries.write("../../arc", FIRST)
    assert entries.read("../../arc") == FIRST
    assert [path.name for path in tmp_path.iterdir()] == ["mission"]


def test_without_a_folder_or_a_disk_components_are_asked_through_the_hub(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    entries = HostEntries(tmp_path / "gone")
    with caplog.at_level(logging.WARNING):
        entries.write(ARC, FIRST)
    assert "through the hub" in caplog.text
    assert entries.read(ARC) is None
    entries.remove(ARC, FIRST)
