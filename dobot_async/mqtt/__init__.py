"""Arms at an MQTT broker: what they do, for dashboards and Home Assistant; and commands of who holds the lease.

    async with open_site(Member("sim:", Magician), allow_motion=True) as site:
        await Gateway(Works(site), Broker("127.0.0.1")).run()

It needs the extra `mqtt`; docs/mqtt.md has the topics.
"""

from dobot_async.mqtt.broker import Broker, broker_at
from dobot_async.mqtt.gateway import Gateway

__all__ = ["Broker", "Gateway", "broker_at"]
