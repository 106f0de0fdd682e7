"""Eclipse Zenoh: the transport, its session, its messages and its configuration."""
