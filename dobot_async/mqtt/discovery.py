"""The discovery message of an arm for Home Assistant: one device with its entities.

A button sends a new id with each press, so that a message that is delivered twice is obeyed once.
"""

from __future__ import annotations

from typing import Any

from dobot_async.mqtt.topics import Topics
from dobot_async.remote import RemoteArm

__all__ = ["HOME_ASSISTANT", "discovery_of", "discovery_topic"]

HOME_ASSISTANT = "homeassistant"
"""The session of its buttons."""

LEASE = 60
"""Seconds for which its switch takes the lease."""


def discovery_topic(prefix: str, name: str) -> str:
    """Return where Home Assistant looks."""
    return f"{prefix}/device/dobot_{name}/config"


def discovery_of(on: RemoteArm, topics: Topics, will: str, *, joints: int, moves: bool) -> dict[str, Any]:
    """Return what it is told.

    Args:
        on: The arm.
        topics: Its topics.
        will: Where the gateway says that it is there.
        joints: How many joints the arm has.
        moves: Whether it may be moved.
    """
    identity = f"dobot_{on.name}"
    components = {**sensors(joints), **(controls(topics) if moves else {})}
    return {
        "device": {"identifiers": [identity], "name": on.name, "model": on.traits.title},
        "origin": {"name": "dobot-async"},
        "availability": [{"topic": will}, {"topic": topics.available}],
        "availability_mode": "all",
        "state_topic": topics.state,
        "qos": 1,
        "components": {
            f"{identity}_{key}": {"unique_id": f"{identity}_{key}", **component}
            for key, component in components.items()
        },
    }


def sensor(name: str, template: str, **more: Any) -> dict[str, Any]:
    """A reading."""
    return {"platform": "sensor", "name": name, "value_template": f"{{{{ {template} }}}}", **more}


def sensors(joints: int) -> dict[str, dict[str, Any]]:
    """What is read."""
    length = {"unit_of_measurement": "mm", "device_class": "distance", "state_class": "measurement"}
    angle = {"unit_of_measurement": "°", "state_class": "measurement"}
    hidden = {"entity_category": "diagnostic"}
    return {
        **{axis: sensor(axis.upper(), f"value_json.pose.{axis}", **length) for axis in "xyz"},
        **{
            f"j{number + 1}": sensor(f"Joint {number + 1}", f"value_json.pose.joints[{number}]", **angle)
            for number in range(joints)
        },
        "alarms": sensor("Alarms", "value_json.alarms | map(attribute='text') | join('; ') | truncate(250)"),
        "doing": sensor("Doing", "value_json.doing or 'nothing'"),
        "pending": sensor("Queue", "value_json.pending", **hidden),
        "link": sensor("Link", "value_json.link", **hidden),
        "moving": {
            "platform": "binary_sensor",
            "name": "Moving",
            "device_class": "moving",
            "value_template": "{{ 'ON' if value_json.pending or value_json.doing else 'OFF' }}",
        },
    }


def button(topics: Topics, name: str, do: str, **more: Any) -> dict[str, Any]:
    """A button that sends a command."""
    text = f'{{"session": "{HOME_ASSISTANT}", "id": "{{{{ now().timestamp() }}}}", "do": "{do}"}}'
    return {"platform": "button", "name": name, "command_topic": topics.do, "command_template": text, "qos": 1, **more}


def controls(topics: Topics) -> dict[str, dict[str, Any]]:
    """What is done."""
    session = f'"session": "{HOME_ASSISTANT}"'
    return {
        "stop": button(topics, "Stop", "stop"),
        "home": button(topics, "Home", "home"),
        "recover": button(topics, "Clear alarms", "recover"),
        "lease": {
            "platform": "switch",
            "name": "May move it",
            "command_topic": topics.do,
            "payload_on": f'{{{session}, "do": "take_lease", "seconds": {LEASE}}}',
            "payload_off": f'{{{session}, "do": "release_lease"}}',
            "state_topic": topics.lease,
            "value_template": f"{{{{ 'ON' if value_json.holder == '{HOME_ASSISTANT}' else 'OFF' }}}}",
            "state_on": "ON",
            "state_off": "OFF",
            "qos": 1,
        },
    }
