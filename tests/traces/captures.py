"""Captures as Wireshark writes them, made of what an arm and its host say."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

__all__ = ["MAGICIAN", "MYCOBOT", "ULTRAARM", "Said", "over_tcp", "over_udp", "over_usb", "write_pcap"]

RAW_IP, USB, MAGICIAN, MYCOBOT, ULTRAARM = 101, 220, 147, 148, 149
"""Link types; the last three are those of the user."""
Said = tuple[bool, bytes]
"""Whether the host said it, and the bytes."""
HOST, ARM = bytes((10, 0, 0, 1)), bytes((10, 0, 0, 2))
HOST_PORT = 50000


def write_pcap(path: Path, link: int, packets: Sequence[bytes]) -> Path:
    """Writes a capture."""
    data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, link)
    for number, packet in enumerate(packets):
        data += struct.pack("<IIII", 1_700_000_000, number * 1000, len(packet), len(packet)) + packet

    path.write_bytes(data)
    return path


def ip(protocol: int, outgoing: bool, payload: bytes) -> bytes:
    """An IPv4 packet."""
    source, target = (HOST, ARM) if outgoing else (ARM, HOST)
    head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(payload), 0, 0x4000, 64, protocol, 0, source, target)
    total = sum(struct.unpack(">10H", head))
    check = ~(total + (total >> 16)) & 0xFFFF
    return head[:10] + struct.pack(">H", check) + head[12:] + payload


def over_udp(said: Sequence[Said], port: int) -> tuple[int, list[bytes]]:
    """Each message a datagram."""
    packets = []
    for outgoing, data in said:
        ports = (HOST_PORT, port) if outgoing else (port, HOST_PORT)
        packets.append(ip(17, outgoing, struct.pack(">HHHH", *ports, 8 + len(data), 0) + data))

    return RAW_IP, packets


def over_tcp(said: Sequence[Said], port: int) -> tuple[int, list[bytes]]:
    """A connection, from its beginning, with each message a segment."""

    def segment(outgoing: bool, flags: int, data: bytes = b"") -> bytes:
        ports = (HOST_PORT, port) if outgoing else (port, HOST_PORT)
        numbers = (sent[outgoing], sent[not outgoing])
        head = struct.pack(">HHIIBBHHH", *ports, *numbers, 5 << 4, flags, 65535, 0, 0)
        sent[outgoing] += len(data) + (flags & 2 != 0)
        return ip(6, outgoing, head + data)

    sent = {True: 1000, False: 5000}
    packets = [segment(True, 0x02), segment(False, 0x12), segment(True, 0x10)]
    packets += [segment(outgoing, 0x18, data) for outgoing, data in said]
    return RAW_IP, packets


def over_usb(said: Sequence[Said]) -> tuple[int, list[bytes]]:
    """Bulk transfers of a USB bridge as Linux's usbmon shows them: out when submitted, in when done."""
    packets = []
    for number, (outgoing, data) in enumerate(said):
        kind, endpoint = (b"S", 0x02) if outgoing else (b"C", 0x82)
        setup = bytes(24)
        where = (0x1000 + number, kind, 3, endpoint, 5, 1, 0, 0)
        head = struct.pack("<Q1sBBBHbbqiiII", *where, 1_700_000_000, number, -115, len(data), len(data))
        packets.append(head + setup + data)

    return USB, packets
