"""The Dobot Magician: commands, alarms, kinematics, and the arm itself."""
