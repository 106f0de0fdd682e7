"""What is used of Zenoh's methods that its stubs leave without a type for what they return."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import zenoh

__all__ = ["LivelinessToken", "TopicPublisher", "answering", "declared", "publishing", "settable"]


class SettableConfig(Protocol):
    """A configuration whose values can be set."""

    def insert_json5(self, key: str, value: str) -> object:
        """Set one value, written in JSON; raise ZError if it is none."""
        ...


class PublishingSession(Protocol):
    """A session that sends, and that can be closed."""

    def put(
        self,
        key_expr: str,
        payload: bytes,
        *,
        congestion_control: zenoh.CongestionControl,
        priority: zenoh.Priority,
        express: bool,
    ) -> None:
        """Send a message; raise ZError when the session is closed."""
        ...

    def close(self) -> object:
        """Close it; it may take seconds."""
        ...


class TopicPublisher(Protocol):
    """One key that is published."""

    def put(self, payload: str) -> object:
        """Publish a value."""
        ...


class AnswerableQuery(Protocol):
    """A query that can be answered."""

    def reply(self, key_expr: zenoh.KeyExpr, payload: bytes) -> object:
        """Answer it."""
        ...

    def reply_err(self, payload: bytes) -> object:
        """Answer it with an error."""
        ...


class LivelinessToken(Protocol):
    """What says that somebody is there, until it is taken back."""

    def undeclare(self) -> object:
        """Take it back."""
        ...


def settable(config: zenoh.Config) -> SettableConfig:
    """Return a configuration as what can be set."""
    return config


def publishing(session: zenoh.Session) -> PublishingSession:
    """Return a session as what sends and can be closed."""
    return session


def answering(query: zenoh.Query) -> AnswerableQuery:
    """Return a query as what can be answered."""
    return query


def declared(token: zenoh.LivelinessToken) -> LivelinessToken:
    """Return a token as what can be taken back."""
    return token
