"""Pieces that know nothing of arms: tasks and hooks."""
