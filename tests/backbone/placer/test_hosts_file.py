"""The file from which the next placer learns the hosts of the mission."""

from __future__ import annotations

from pathlib import Path

from backbone.placer.fences import Fences
from backbone.placer.hosts_file import FILE_NAME, HostsFile


def test_the_next_placer_reads_the_hosts_of_all_before_it(tmp_path: Path) -> None:
    for host in ("near", "far"):
        one = HostsFile(str(tmp_path))
        one.read()
        one.keep(host)
    assert HostsFile(str(tmp_path)).read() == {"near", "far"}
    assert HostsFile("").read() == frozenset()


def test_after_a_file_that_cannot_be_read_each_new_name_waits_as_if_a_host_were_silent(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_bytes(b"\xc1")
    fences = Fences(lambda host: host == "near")
    fences.after_restart(HostsFile(str(tmp_path)).read(), 7.0)
    fences.name_entered("w")
    assert fences.until_s("w", 6.9) == 7.0
    assert fences.until_s("w", 7.0) is None


def test_a_name_waits_until_all_hosts_are_back_that_may_run_it() -> None:
    alive: set[str] = set()
    fences = Fences(alive.__contains__)
    fences.after_restart({"near", "far"}, 7.0)
    fences.name_entered("w")
    alive.add("near")
    assert (fences.until_s("w", 1.0), fences.hosts("w")) == (7.0, {"near", "far"})
    alive.add("far")
    assert fences.until_s("w", 1.0) is None
    assert fences.hosts("w") == frozenset()
