"""A bridge: one arm on any transport, for several programs on a network; see docs/bridge.md."""

from dobot_async.bridge.events import BridgeEvent
from dobot_async.bridge.limits import Limits
from dobot_async.bridge.service import Bridge
from dobot_async.bridge.start import bridge

__all__ = ["Bridge", "BridgeEvent", "Limits", "bridge"]
