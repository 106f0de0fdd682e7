"""What Home Assistant is told is what it takes: templates find their values in the state, and its own schemas pass it.

The schemas are those of an installed Home Assistant (2024.12 or later), which needs a Python of its own choice:

    pip install 'homeassistant>=2025.3,<2025.5' paho-mqtt    # with Python 3.13
    DOBOT_REQUIRE_HOME_ASSISTANT=1 python -m pytest tests/mqtt/test_home_assistant.py
"""

from __future__ import annotations

import json
import os
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from jinja2 import Environment, StrictUndefined

from dobot_async.mqtt.discovery import discovery_of
from dobot_async.mqtt.topics import Topics, will_topic

JOINTS = {"Dobot Magician": 4, "myCobot 280": 6, "ultraArm P340": 3}
STATE = {
    "pose": {"x": 220.0, "y": -1.5, "z": 40.0, "joints": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]},
    "alarms": [{"text": "one"}, {"text": "two"}],
    "pending": 0,
    "doing": None,
    "link": "open",
    "holder": "homeassistant",
}
SHARED = ("availability", "availability_mode", "state_topic", "qos", "device", "origin")


def told(family: str, *, moves: bool = True) -> dict[str, Any]:
    """What Home Assistant is told of an arm."""
    on: Any = SimpleNamespace(name="left", traits=SimpleNamespace(title=family))
    text = json.dumps(
        discovery_of(on, Topics("dobot", "left"), will_topic("dobot", "id"), joints=JOINTS[family], moves=moves)
    )
    found: dict[str, Any] = json.loads(text)
    return found


def rendered(template: str, **values: Any) -> str:
    """What a template makes of values; fails if it asks for one that is not there."""
    return Environment(undefined=StrictUndefined, autoescape=False).from_string(template).render(**values)


@pytest.mark.parametrize("family", JOINTS)
def test_templates_find_their_values_in_the_state(family: str) -> None:
    components = told(family)["components"]
    values = {
        name.removeprefix("dobot_left_"): rendered(each["value_template"], value_json=STATE)
        for name, each in components.items()
        if "value_template" in each
    }
    assert {each: values.pop(each) for each in ("x", "y", "z")} == {"x": "220.0", "y": "-1.5", "z": "40.0"}
    for joint in range(1, JOINTS[family] + 1):
        assert values.pop(f"j{joint}") == f"{joint}.0"

    assert values == {
        "alarms": "one; two",
        "doing": "nothing",
        "pending": "0",
        "link": "open",
        "moving": "OFF",
        "lease": "ON",
    }


def test_a_button_sends_a_command() -> None:
    template = told("Dobot Magician")["components"]["dobot_left_home"]["command_template"]
    pressed = rendered(template, now=lambda: SimpleNamespace(timestamp=lambda: 1764540000.5))
    assert json.loads(pressed) == {"session": "homeassistant", "id": "1764540000.5", "do": "home"}


@pytest.mark.filterwarnings("ignore")  # of Home Assistant's own parts
@pytest.mark.parametrize("moves", [True, False])
@pytest.mark.parametrize("family", JOINTS)
async def test_the_schemas_of_home_assistant_take_it(family: str, moves: bool, tmp_path: Path) -> None:
    if not os.environ.get("DOBOT_REQUIRE_HOME_ASSISTANT"):
        pytest.importorskip("homeassistant.components.mqtt.schemas", reason="Home Assistant is not installed")

    running = import_module("homeassistant.core").HomeAssistant(str(tmp_path))  # templates are checked in one that runs
    try:
        found = told(family, moves=moves)
        import_module("homeassistant.components.mqtt.schemas").DEVICE_DISCOVERY_SCHEMA(found)
        for component in found["components"].values():
            config = {key: found[key] for key in SHARED} | component
            platform = config.pop("platform")
            import_module(f"homeassistant.components.mqtt.{platform}").DISCOVERY_SCHEMA(config)
    finally:
        await running.async_stop(force=True)
