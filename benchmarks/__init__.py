"""What the driver does in how much time, on how much of a processor; `python -m benchmarks` measures all of it."""
