"""The command line: `dobot-async` and `python -m dobot_async`. Needs the extra `cli` (click and rich)."""
