"""Motions: the queue, its writer and its poller, and what a family brings to it."""
