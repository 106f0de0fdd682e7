"""The figures of a panel's arms, for Prometheus."""

from __future__ import annotations

from dobot_async.metrics import metrics_text, read_figures
from dobot_async.panel.state import PanelState

__all__ = ["panel_metrics"]


async def panel_metrics(state: PanelState) -> bytes:
    """Return the figures of the arms that are connected; see `dobot_async.metrics`.

    Args:
        state: What is behind the panel.

    Raises:
        ImportError: The extra `metrics` is not installed.
    """
    arms = {name: station for name, station in state.stations.items() if station.connected}
    return metrics_text(
        {
            name: await read_figures(station.view.arm, held=station.lease.holder is not None)
            for name, station in arms.items()
        }
    )
