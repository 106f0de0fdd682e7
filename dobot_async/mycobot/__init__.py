"""The commands of the myCobot family for users: `from dobot_async.mycobot import commands`."""
