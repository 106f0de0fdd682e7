"""A live panel in the browser: arms watched, jogged, taught and stopped from any phone; see docs/panel.md."""

from dobot_async.panel.access import Role
from dobot_async.panel.start import Panel, panel

__all__ = ["Panel", "Role", "panel"]
