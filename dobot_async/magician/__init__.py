"""The commands of the Dobot Magician for users: `from dobot_async.magician import commands`."""
