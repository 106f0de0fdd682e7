"""The commands of the ultraArm P340 for users: `from dobot_async.ultraarm import commands`."""
