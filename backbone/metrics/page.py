"""The page that Prometheus reads: the tally and the components' own numbers, under names in Prometheus' style."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate

from prometheus_client import CollectorRegistry, start_http_server
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from backbone.metrics.tally import BUCKETS_S, SwitchHistogram, Tally

Metrics = list[Metric]
Values = Iterable[tuple[tuple[str, ...], float]]
"""Values of the labels, and the number."""
ENDS = [*map(str, BUCKETS_S), "+Inf"]


@dataclass(frozen=True)
class Numbers:
    """The content of the page.

    Attributes:
        tally: The tally, counted up to now.
        utilization: RC → share of the last minute in which it was held; of a sharable RC, share of its capacity.
        statistics: Component and name → its own count or measurement.
        dropped: Number of messages that came too fast to be counted.
    """

    tally: Tally
    utilization: Mapping[str, float]
    statistics: Mapping[tuple[str, str], float]
    dropped: int


class MetricsServer:
    """Serves the page until it is closed.

    Args:
        read: Called in a thread of its own for each request of the page.

    Raises:
        OSError: The port cannot be opened.
    """

    def __init__(self, host: str, port: int, read: Callable[[], Metrics]) -> None:
        registry = CollectorRegistry()
        registry.register(_Page(read))
        self._server, self._thread = start_http_server(port, host, registry)

    def close(self) -> None:
        """Close the port."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Page(Collector):
    def __init__(self, read: Callable[[], Metrics]) -> None:
        self._read = read

    def collect(self) -> Iterable[Metric]:
        return self._read()


def metrics(numbers: Numbers) -> Metrics:
    """Return all metrics."""
    tally = numbers.tally
    return [
        _counter("watched_seconds", "Mission time that the other counters cover.", [], [((), tally.watched_s)]),
        _counter("rc_held_seconds", "Time for which an ARC held an RC.", ["rc", "arc"], tally.held_s.items()),
        _counter("rc_waited_seconds", "Time for which an ARC waited for an RC.", ["rc", "arc"], tally.waited_s.items()),
        _counter("arc_state_seconds", "Time of a request in a state.", ["arc", "state"], tally.in_state_s.items()),
        _counter("rc_grants", "Grants of an RC to an ARC.", ["rc", "arc"], tally.grants.items()),
        _counter(
            "rc_revocations", "Revocations of an RC from an ARC.", ["rc", "arc", "why"], tally.revocations.items()
        ),
        _histogram(tally.switches),
        _gauge("rc_up", "1: the RC is up.", ["rc"], [((rc,), float(is_up)) for rc, is_up in tally.is_up.items()]),
        _gauge(
            "rc_utilization_ratio",
            "Share of the last minute in which the RC was held; of a sharable one, of its capacity.",
            ["rc"],
            [((rc,), share) for rc, share in numbers.utilization.items()],
        ),
        _gauge(
            "component_statistic",
            "What a component counts and measures itself, drops among it; units are in the names.",
            ["component", "statistic"],
            numbers.statistics.items(),
        ),
        _counter("metrics_dropped_messages", "Messages that came too fast to be counted.", [], [((), numbers.dropped)]),
    ]


def _counter(name: str, what: str, labels: list[str], values: Values) -> Metric:
    return _filled(CounterMetricFamily(f"scout_{name}", what, labels=labels), values)


def _gauge(name: str, what: str, labels: list[str], values: Values) -> Metric:
    return _filled(GaugeMetricFamily(f"scout_{name}", what, labels=labels), values)


def _filled(family: CounterMetricFamily | GaugeMetricFamily, values: Values) -> Metric:
    for labelled, value in values:
        family.add_metric(labelled, value)
    return family


def _histogram(switches: Mapping[str, SwitchHistogram]) -> Metric:
    what = "Time from the revocation of an ARC for another to the grant of that other, settling included."
    family = HistogramMetricFamily("scout_rc_switch_seconds", what, labels=["rc"])
    for rc, histogram in switches.items():
        family.add_metric([rc], list(zip(ENDS, accumulate(histogram.counts), strict=True)), histogram.sum_s)
    return family
