"""The Elephant Robotics ultraArm P340: lines of G-code, a queue without indices, replies without numbers."""
