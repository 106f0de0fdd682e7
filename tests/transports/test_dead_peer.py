"""A network that goes away without a word, on both sides, in network namespaces of the test's own: root and Linux."""

# ruff: noqa: T201 - what it prints is what it is for

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import trustme

HERE = Path(__file__).parent
SERVER, CLIENT = "192.0.2.1", "192.0.2.2"
FOUND_WITHIN = 10.0  # seconds
LEFT_ALONE = 4.0  # seconds; what is found sooner than this is an accident


def ip(*words: str) -> None:
    """Calls `ip` of iproute2."""
    subprocess.run([shutil.which("ip") or "ip", *words], check=True, capture_output=True, timeout=10)


@pytest.fixture
def networks() -> Iterator[tuple[str, str]]:
    """Two network namespaces with a cable between them; "cable" is the name of either end."""
    if not shutil.which("ip") or os.name != "posix" or os.geteuid() != 0:
        pytest.skip("needs root, and ip of iproute2")

    names = (f"dobot-{os.getpid()}-a", f"dobot-{os.getpid()}-b")
    try:
        try:
            for name in names:
                ip("netns", "add", name)

            ip("link", "add", "cable", "netns", names[0], "type", "veth", "peer", "name", "cable", "netns", names[1])
            for name, address in zip(names, (SERVER, CLIENT), strict=True):
                ip("-n", name, "address", "add", f"{address}/30", "dev", "cable")
                ip("-n", name, "link", "set", "cable", "up")
        except subprocess.CalledProcessError as error:
            pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")

        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "delete", name], check=False, capture_output=True, timeout=10)


def started(network: str, program: str, *arguments: str) -> subprocess.Popen[str]:
    """Starts a program of this folder in a network."""
    command = ["ip", "netns", "exec", network, sys.executable, str(HERE / program), *arguments]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def ended(process: subprocess.Popen[str]) -> None:
    """Kills a program and forgets it."""
    process.kill()
    process.communicate()


def line(process: subprocess.Popen[str]) -> str:
    """Returns the next line that a program prints."""
    assert process.stdout
    return process.stdout.readline().strip()


@pytest.mark.full
def test_a_network_that_goes_is_noticed_within_ten_seconds_on_both_sides(
    networks: tuple[str, str], tmp_path: Path
) -> None:
    authority = trustme.CA()
    ca, certificate = tmp_path / "ca.pem", tmp_path / "server.pem"
    authority.cert_pem.write_to_path(ca)
    authority.issue_cert(SERVER).private_key_and_cert_chain_pem.write_to_path(certificate)
    server = started(networks[0], "dead_peer_server.py", SERVER, str(certificate))
    try:
        urls = line(server).split()
        client = started(networks[1], "dead_peer_client.py", str(ca), *urls)
        try:
            assert line(client) == "open"
            ip("-n", networks[0], "link", "set", "cable", "down")
            down = time.monotonic()
            assert client.stdin
            client.stdin.write("down\n")
            client.stdin.flush()
            found = [json.loads(line(client)) for _ in range(3 * len(urls) + 1)]
        finally:
            ended(client)

        on_tcp = 3 * 2 + 1
        left = [float(line(server)) - down for _ in range(on_tcp)]
    finally:
        ended(server)

    for each in sorted(found, key=lambda each: str(each["what"])):
        print(f"{each['what']:16} {each['seconds']:5.2f} s  {each['error']} from {each['cause']}")

    print(f"{'server':16} {min(left):5.2f} to {max(left):.2f} s")
    for each in found:
        assert each["error"] == ("ConnectionLost" if each["what"] == "link idle" else "BrokenResourceError"), each
        assert LEFT_ALONE < each["seconds"] < FOUND_WITHIN, each

    assert max(left) < FOUND_WITHIN
