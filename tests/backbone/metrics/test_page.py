"""Prometheus reads the page, with names and kinds as it wants them."""

from __future__ import annotations

import urllib.request
from collections.abc import Iterator

import pytest
from free_ports import free_port
from prometheus_client.parser import text_string_to_metric_families

from backbone.command_line.listening import PortUnusable, opening_port
from backbone.metrics.page import MetricsServer, Numbers, metrics
from backbone.metrics.tally import Tally
from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule

ARC = "anna-drive"
LABELS = ("component", "statistic", "rc", "arc", "state", "why", "le")


@pytest.fixture
def numbers() -> Numbers:
    """Return what is known of a robot that was held for 3 s, and then handed over within 0.3 s."""
    tally = Tally()
    rc = RcView("scout1", "scout", "up", False, 1.0, [Holder(ARC, 1, 0.0, 0.0)], 1, [])
    request = RequestView(
        "watch", "mission_control/watch", RequestState.WAITING, ["scout1"], 0, -1, -1, "", [], 1, "", 0
    )
    tally.take_schedule(Schedule(0.0, [rc], [request], []))
    tally.take_leases(Leases([], 60.0), 0.0)
    tally.advance(3.0)
    tally.take_line({"ev": "revoke", "t": 3.0, "arc": ARC, "why": "slice", "by": "watch"})
    tally.take_line({"ev": "grant", "t": 3.3, "arc": "watch", "epoch": {"scout1": 2}})
    return Numbers(tally, {"scout1": 0.75}, {("grabber", "frames_garbled"): 7.0}, 2)


@pytest.fixture
def port(numbers: Numbers) -> Iterator[int]:
    port = free_port()
    server = MetricsServer("127.0.0.1", port, lambda: metrics(numbers))
    yield port
    server.close()


@pytest.mark.parametrize("host", ["192.0.2.1", "192.168..1"], ids=["of no machine here", "no name of a host"])
def test_an_address_that_cannot_be_had_is_refused_with_a_remedy(host: str) -> None:
    with pytest.raises(PortUnusable, match=f"at {host}:1") as refused, opening_port(host, 1):
        MetricsServer(host, 1, list)
    assert "--host" in refused.value.remedy


def test_all_numbers_are_on_the_page_under_their_names(port: int) -> None:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as page:
        families = list(text_string_to_metric_families(page.read().decode()))
    found = {
        (sample.name, *(sample.labels[name] for name in LABELS if name in sample.labels)): sample.value
        for of in families
        for sample in of.samples
    }
    assert (
        found.items()
        >= {
            ("scout_watched_seconds_total",): 3.0,
            ("scout_rc_held_seconds_total", "scout1", ARC): 3.0,
            ("scout_rc_waited_seconds_total", "scout1", "watch"): 3.0,
            ("scout_arc_state_seconds_total", "watch", "waiting"): 3.0,
            ("scout_rc_grants_total", "scout1", "watch"): 1.0,
            ("scout_rc_revocations_total", "scout1", ARC, "slice"): 1.0,
            ("scout_rc_switch_seconds_bucket", "scout1", "0.2"): 0.0,
            ("scout_rc_switch_seconds_bucket", "scout1", "0.5"): 1.0,
            ("scout_rc_switch_seconds_count", "scout1"): 1.0,
            ("scout_rc_up", "scout1"): 1.0,
            ("scout_rc_utilization_ratio", "scout1"): 0.75,
            ("scout_component_statistic", "grabber", "frames_garbled"): 7.0,
            ("scout_metrics_dropped_messages_total",): 2.0,
        }.items()
    )
    kinds = {family.name: family.type for family in families}
    assert (kinds["scout_rc_held_seconds"], kinds["scout_rc_switch_seconds"]) == ("counter", "histogram")
    assert all(family.documentation for family in families)
