"""Bluetooth Low Energy: the transport, the scan, one program at a time, and what bleak's errors mean."""
