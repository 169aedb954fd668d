"""A switch lasts from the first revocation from another ARC to the grant, without the time in which RCs settle."""

from __future__ import annotations

from backbone.rc_manager.switch_times import SwitchTimes


def test_a_switch_counts_from_the_first_revocation_from_another_arc() -> None:
    times = SwitchTimes()
    assert times.statistics() == {"switches": 0.0, "switch_p50_s": 0.0, "switch_p99_s": 0.0}
    times.revoked(["video", "left"], "one", 10.0)
    times.revoked(["radio"], "two", 10.5)
    times.granted(["video", "radio"], "three", 0.25, 11.0)
    assert times.statistics() == {"switches": 1.0, "switch_p50_s": 0.75, "switch_p99_s": 0.75}


def test_an_arc_that_gets_its_own_rcs_back_is_no_switch() -> None:
    times = SwitchTimes()
    times.revoked(["video"], "one", 10.0)
    times.granted(["video"], "one", 0.0, 12.0)
    times.granted(["video"], "two", 0.0, 13.0)
    assert times.statistics()["switches"] == 0.0
