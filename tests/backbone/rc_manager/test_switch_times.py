"""A switch lasts from the first revocation for an ARC to its grant, without the time in which RCs settle."""

from __future__ import annotations

from backbone.rc_manager.switch_times import SwitchTimes


def test_a_switch_counts_from_the_first_revocation_for_the_arc() -> None:
    times = SwitchTimes()
    assert times.statistics() == {"switches": 0.0, "switch_p50_s": 0.0, "switch_p99_s": 0.0}
    times.revoked(["video", "left"], "three", 10.0)
    times.revoked(["radio"], "three", 10.5)
    times.granted(["video", "radio"], "three", 0.25, 11.0)
    assert times.statistics() == {"switches": 1.0, "switch_p50_s": 0.75, "switch_p99_s": 0.75}


def test_a_grant_of_rcs_that_were_free_is_no_switch() -> None:
    """Their last holder wanted no time any more, and nobody else wanted any for an hour."""
    times = SwitchTimes()
    times.revoked(["video"], "", 10.0)
    times.granted(["video"], "two", 0.0, 3610.0)
    assert times.statistics()["switches"] == 0.0


def test_an_arc_that_gets_rcs_revoked_for_another_is_no_switch() -> None:
    times = SwitchTimes()
    times.revoked(["video"], "two", 10.0)
    times.granted(["video"], "one", 0.0, 12.0)
    times.granted(["video"], "two", 0.0, 13.0)
    assert times.statistics()["switches"] == 0.0
