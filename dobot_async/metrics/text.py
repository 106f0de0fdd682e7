"""The figures of arms as Prometheus reads them: a row for each metric, with its name, its kind and what it says."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

from dobot_async.metrics.figures import ArmFigures

if TYPE_CHECKING:
    from prometheus_client.core import Metric

__all__ = ["CONTENT_TYPE", "metrics_text"]

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
MISSING = "prometheus-client is not installed, and metrics need it: pip install 'dobot-async[metrics]'"
GAUGE, COUNTER = "gauge", "counter"


class MetricRow(NamedTuple):
    """One metric.

    Attributes:
        name: Without the `_total` of counters.
        kind: "gauge" or "counter".
        text: What it says.
        value: Where its value is in the figures; None leaves it out.
    """

    name: str
    kind: str
    text: str
    value: str


ROWS = (
    MetricRow("dobot_link_up", GAUGE, "Whether the link to the arm is open.", "up"),
    MetricRow("dobot_link_outages", COUNTER, "How often the link was lost and reopened.", "outages"),
    MetricRow("dobot_link_requests", COUNTER, "Requests sent, repeated ones included.", "stats.sent"),
    MetricRow("dobot_link_replies", COUNTER, "Whole frames received.", "stats.received"),
    MetricRow("dobot_link_repeats", COUNTER, "Requests sent again.", "stats.repeated"),
    MetricRow("dobot_link_losses", COUNTER, "Requests that were not answered in their turn.", "stats.lost"),
    MetricRow("dobot_link_timeouts", COUNTER, "Calls that failed without an answer.", "stats.timeouts"),
    MetricRow("dobot_link_unexpected", COUNTER, "Frames that answered nothing.", "stats.unexpected"),
    MetricRow("dobot_link_bad_frames", COUNTER, "Frames with a wrong checksum.", "stats.bad_frames"),
    MetricRow("dobot_link_junk_bytes", COUNTER, "Bytes that belong to no frame.", "stats.junk_bytes"),
    MetricRow("dobot_link_round_trip_seconds", GAUGE, "What an answer takes on the average.", "round_trip"),
    MetricRow("dobot_queue_pending", GAUGE, "Accepted commands that have not ended.", "pending"),
    MetricRow("dobot_alarms", GAUGE, "Alarms that are set.", "alarms"),
    MetricRow("dobot_moving", GAUGE, "Whether the arm is in the middle of something.", "moving"),
    MetricRow("dobot_lease_held", GAUGE, "Whether somebody has the lease.", "held"),
    MetricRow("dobot_bridge_clients", GAUGE, "Clients of the bridge.", "clients"),
    MetricRow("dobot_bridge_stops", COUNTER, "How often something stopped the arm.", "stops"),
)


class MetricsCollector:
    """What a registry collects, once."""

    def __init__(self, arms: Mapping[str, ArmFigures]) -> None:
        self._arms = arms

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics of all arms."""
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

        kinds = {GAUGE: GaugeMetricFamily, COUNTER: CounterMetricFamily}
        for row in ROWS:
            family = kinds[row.kind](row.name, row.text, labels=["arm"])
            for name, figures in self._arms.items():
                value: float | None = attrgetter(row.value)(figures)
                if value is not None:
                    family.add_metric([name], float(value))

            if family.samples:
                yield family

        motions = CounterMetricFamily("dobot_motions", "Motions that ended, by how.", labels=["arm", "outcome"])
        for name, outcome, count in self._ended():
            motions.add_metric([name, outcome], count)

        yield motions

    def _ended(self) -> Iterable[tuple[str, str, int]]:
        for name, figures in self._arms.items():
            if figures.pending is not None:
                for outcome, count in sorted({"done": 0, **figures.motions}.items()):
                    yield name, outcome, count


def metrics_text(arms: Mapping[str, ArmFigures]) -> bytes:
    """Return the figures of arms in Prometheus' text format, to be served as `CONTENT_TYPE`.

    Args:
        arms: The figures, by the names of the arms.

    Raises:
        ImportError: The extra `metrics` is not installed.
    """
    try:
        from prometheus_client import CollectorRegistry, generate_latest
    except ImportError as error:
        raise ImportError(MISSING, name=error.name) from error

    registry = CollectorRegistry(auto_describe=False)
    registry.register(MetricsCollector(arms))
    return generate_latest(registry)
