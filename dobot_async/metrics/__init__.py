"""Figures of arms for Prometheus: their links, queues, alarms and motions; docs/mqtt.md has the table.

    from dobot_async.metrics import figures_of, metrics_text

    text = metrics_text({"left": figures_of(arm)})

It needs the extra `metrics`.
"""

from dobot_async.metrics.figures import ArmFigures, figures_of, figures_of_bridge, read_figures
from dobot_async.metrics.server import serve_metrics
from dobot_async.metrics.text import CONTENT_TYPE, metrics_text

__all__ = [
    "CONTENT_TYPE",
    "ArmFigures",
    "figures_of",
    "figures_of_bridge",
    "metrics_text",
    "read_figures",
    "serve_metrics",
]
