"""An arm's name on Eclipse Zenoh, and how this computer gets there: the URL, and the configuration made of it.

Without a file of Zenoh's own, what is not said stays closed: a server listens on this computer alone, and a session
with an address looks for nobody else.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import SplitResult, urlencode

from dobot_async.errors import ConnectFailed
from dobot_async.transports.options import Option, options, words
from dobot_async.transports.zenoh.typed import settable

if TYPE_CHECKING:
    import zenoh

__all__ = ["NAME", "ZenohConfig", "address", "library", "reason"]

GONE = {
    "transport/unicast/open_timeout": (10_000, 3000),  # milliseconds
    "transport/link/tx/lease": (10_000, 1500),  # milliseconds
    "transport/link/tx/queue/congestion_control/block/wait_before_close": (5_000_000, 1_500_000),  # microseconds
}
"""After what time somebody who does not answer, says nothing, or reads nothing counts as gone: Zenoh's, and ours."""
RETRY = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
CONFIGURATION = "ZENOH_CONFIG"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
WHERE_IN_ZENOH = re.compile(r" at /\S+\.rs:\d+\.?")
OWN: dict[str, Any] = {"mode": "peer", "connect/retry": RETRY}
NOBODY: dict[str, list[str]] = {"router": [], "peer": [], "client": []}
ALONE = {"scouting/multicast/enabled": False, "scouting/gossip/enabled": False}
THIS_COMPUTER: dict[str, Any] = {
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "scouting/multicast/autoconnect": NOBODY,
    "scouting/gossip/enabled": False,
}


def library() -> Any:
    """Returns the module zenoh; raises ConnectFailed where it is not installed."""
    try:
        import zenoh  # noqa: PLC0415 - only who uses Zenoh needs it
    except ImportError:
        raise ConnectFailed("zenoh:// needs the package eclipse-zenoh: pip install 'dobot-async[zenoh]'") from None

    return zenoh


def reason(error: Exception) -> str:
    """Returns what Zenoh complains of, without the places in its source."""
    return WHERE_IN_ZENOH.sub("", str(error)).strip()


@dataclass(frozen=True, slots=True)
class ZenohConfig:
    """An arm's name on Zenoh, and how the network of Zenoh is reached.

    Attributes:
        name: Of the arm.
        config: A configuration file of Zenoh's, which says everything; else ZENOH_CONFIG may name one.
        connect: Endpoints to connect to, such as `tcp/192.168.1.20:7447`, in place of the file's. Without a file, and
            with nothing to listen at, the first that answers is the only one.
        listen: Endpoints to listen at, in place of the file's.
        lan: Whether a server without all of these is there for everybody in its network.
    """

    name: str
    config: str | None = None
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    lan: bool = False

    @classmethod
    def of(cls, url: SplitResult, *, serving: bool) -> ZenohConfig:
        """Reads `zenoh://name?config=FILE&connect=tcp/host:port`, for a server also `&listen=` or `&lan=yes`.

        Raises:
            ValueError: It is none.
        """
        found = options(url, CLIENT | SERVER if serving else CLIENT)
        if not NAME.fullmatch(url.netloc) or url.path.strip("/"):
            raise ValueError("expected zenoh://name, of letters, digits, dots, - and _, 100 at most")

        return cls(url.netloc, **found)

    def configuration(self, *, serving: bool) -> zenoh.Config:
        """Returns the configuration of a session; raises ValueError if the file is no good."""
        kind, error_kind = library().Config, library().ZError
        path = self.config or os.environ.get(CONFIGURATION)
        try:
            config: zenoh.Config = kind.from_file(path) if path else kind()
            for key, value in self._settings(config, serving=serving, file=bool(path)).items():
                settable(config).insert_json5(key, json.dumps(value))
        except error_kind as error:
            raise ValueError(f"cannot use the Zenoh configuration {path}: {reason(error)}") from None

        return config

    def _settings(self, config: zenoh.Config, *, serving: bool, file: bool) -> dict[str, Any]:
        """What is set beside, or in place of, a file."""
        found: dict[str, Any] = {"transport/shared_memory/enabled": False}  # it leaves files open, for large messages
        if not file:
            found |= OWN | self._scope(serving=serving)

        for key, (zenohs, ours) in GONE.items():
            if json.loads(config.get_json(key)) == zenohs:
                found[key] = ours

        given = {"connect/endpoints": self.connect, "listen/endpoints": self.listen}
        return found | {key: list(value) for key, value in given.items() if value}

    def _scope(self, *, serving: bool) -> dict[str, Any]:
        """Whom a session without a file finds, and who finds it."""
        if self.listen:
            return ALONE

        if self.connect:
            # A router passes nothing on between two peers, for it takes them to be connected with each other.
            return {"mode": "client", "listen/endpoints": [], **ALONE}

        if serving:
            return {} if self.lan else THIS_COMPUTER

        return {"listen/endpoints": []}


def address(name: str, *, config: str | None = None, connect: tuple[str, ...] = ()) -> str:
    """Returns the URL of an arm for clients."""
    given = {"config": config, "connect": ",".join(connect)}
    query = urlencode({option: value for option, value in given.items() if value}, safe="/:,[]")
    return f"zenoh://{name}{'?' if query else ''}{query}"


def endpoints(text: str) -> tuple[str, ...]:
    """Reads endpoints with commas between them."""
    found = tuple(filter(None, text.split(",")))
    if not found or not all("/" in each for each in found):
        raise ValueError

    return found


def yes(text: str) -> bool:
    """Reads what switches something on."""
    if text != "yes":
        raise ValueError

    return True


ENDPOINTS = Option(endpoints, "endpoints with commas between them, such as tcp/192.168.1.20:7447")
CLIENT = {"config": Option(words, "a configuration file of Zenoh's"), "connect": ENDPOINTS}
SERVER = {"listen": ENDPOINTS, "lan": Option(yes, "yes")}
