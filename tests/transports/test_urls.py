"""What is wrong with a URL is said before anything is opened."""

from __future__ import annotations

import asyncio
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import serial

from dobot_async import ConnectFailed
from dobot_async._core.util.urls import hidden
from dobot_async.transports import SCHEMES, open_transport
from dobot_async.transports.options import number, options

NO_TIMES = ("nan", "inf", "-inf", "-1", "-1e-9", "1e400", "", "1,5", "5ms", "1_0", "%201", "\u0661")
SECONDS = "reorder_window=.*expected seconds, a number from 0 to 10"


def refusal(url: str) -> str:
    """Why a URL is refused. No loop runs the call, so it fails if it waits for anything."""
    opening = open_transport(url, arm="magician")
    with pytest.raises(ValueError, match=r"\S") as refused:
        opening.send(None)

    assert refused.type is ValueError
    return str(refused.value)


@pytest.mark.parametrize(
    "url",
    [
        "",
        "/dev/ttyUSB0",
        "COM3",
        "192.168.1.20",
        "192.168.1.20:8899",
        "//host:1",
        "://host",
        "localhost:8899",
        "usb:///dev/ttyUSB0",
        "http://192.168.1.20",
        "serials:///dev/ttyUSB0",
    ],
)
def test_a_url_without_a_scheme_of_ours_is_shown_all_schemes(url: str) -> None:
    message = refusal(url)
    assert message.startswith(f"{url!r}: this has no scheme")
    for scheme in SCHEMES:
        assert f"{scheme}:" in message


@pytest.mark.parametrize(
    ("url", "wrong"),
    [
        ("tcp://", "expected tcp://host:port"),
        ("tcp://:8899", "expected tcp://host:port"),
        ("tcp://192.168.1.20", "expected tcp://host:port"),
        ("tcp://192.168.1.20:", "expected tcp://host:port"),
        ("tcp://192.168.1.20:0", "expected tcp://host:port"),
        ("tcp://192.168.1.20:8899/path", "expected tcp://host:port"),
        ("tcp:192.168.1.20:8899", "expected tcp://host:port"),
        ("tcp://192.168.1.20:65536", "[Pp]ort out of range"),
        ("tcp://192.168.1.20:-1", "[Pp]ort"),
        ("tcp://192.168.1.20:http", "[Pp]ort.*'http'"),
        ("tcp://[::1", "Invalid IPv6 URL"),
        ("udp://", "expected udp://host"),
        ("udp:", "expected udp://host"),
        ("udp://:8899", "expected udp://host"),
        ("udp://192.168.1.20:0", "expected udp://host"),
        ("udp://192.168.1.20:99999", "[Pp]ort out of range"),
        ("udp://192.168.1.20/path", "expected udp://host"),
        ("udp://[fe80::1", "Invalid IPv6 URL"),
        ("udp://192.168.1.20?baud=1", "unknown option 'baud'; known: reorder_window, token"),
        ("tcp://192.168.1.20:1?window=1", "unknown option 'window'"),
        ("serial:", "expected serial:///dev/ttyUSB0"),
        ("serial://", "expected serial:///dev/ttyUSB0"),
        ("serial://?baud=9600", "expected serial:///dev/ttyUSB0"),
        ("serial:///dev/ttyUSB0?baud=0", "baud=.*expected bits per second, a whole number from 50 to 12000000"),
        ("serial:///dev/ttyUSB0?baud=-9600", "baud=.*expected bits per second, a whole number from 50 to 12000000"),
        ("serial:///dev/ttyUSB0?baud=fast", "baud='fast': expected bits per second"),
        ("serial:///dev/ttyUSB0?baud=", "baud='': expected bits per second"),
        ("serial:///dev/ttyUSB0?baud=9600.0", "baud='9600.0': expected bits per second"),
        ("serial:///dev/ttyUSB0?speed=9600", "unknown option 'speed'; known: baud"),
        ("serial:///dev/ttyUSB0?Baud=9600", "unknown option 'Baud'"),
        ("serial:///dev/ttyUSB0?baud", "'baud'"),
        ("serial:///dev/ttyUSB0?baud=9600&baud=115200", "option baud is given twice"),
        ("serial:///dev/ttyUSB0?&", "'&'|''"),
        *(
            (f"serial:///dev/ttyUSB0?baud={wrong}", "baud=.*bits per second")
            for wrong in ("nan", "1e400", "9_600", "1" * 99)
        ),
        *((f"udp://10.0.0.1?reorder_window={wrong}", SECONDS) for wrong in (*NO_TIMES, "1e9", "10.1")),
        *((f"ble://arm?pace={wrong}", "pace=.*seconds between two chunks") for wrong in (*NO_TIMES, "1.1")),
        ("ble://arm?adapter=", "adapter=''.*hci1"),
        ("ble://arm?adaptor=hci1", "unknown option 'adaptor'; known: pace, adapter"),
        ("udp://10.0.0.1?disorder=0", "unknown option 'disorder'; known: reorder_window, token"),
        ("tcp://10.0.0.1:1?ca=", "ca='': expected a PEM file, or system"),
        ("wss://10.0.0.1:1?ca=", "ca='': expected a PEM file, or system"),
        ("ws://10.0.0.1:1?ca=x", "unknown option 'ca'; known: token"),
        ("tcp://10.0.0.1:1#x", "written %23"),
        ("zenoh://arm?config=", "config='': expected a configuration file"),
        ("zenoh://arm?connect=here", "connect='here': expected endpoints"),
        ("zenoh://arm?lan=yes", "unknown option 'lan'; known: config, connect"),
    ],
)
def test_a_bad_url_names_what_is_wrong(url: str, wrong: str) -> None:
    message = refusal(url)
    assert message.startswith(f"{url!r}: ")
    with pytest.raises(ValueError, match=wrong):
        raise ValueError(message)


@pytest.mark.parametrize("scheme", ["tcp", "udp", "ws", "wss"])
@pytest.mark.parametrize("token", ["gar%20geheim", "geh%C3%BCheim", "", "gar#geheim"])
def test_a_token_that_is_none_is_not_shown(scheme: str, token: str) -> None:
    message = refusal(f"{scheme}://10.0.0.1:1?token={token}")
    assert "geh" not in message
    assert "token: expected a word" in message or "written %23" in message


def test_options_are_converted() -> None:
    found = options(urlsplit("serial:///dev/ttyUSB0?baud=9600"), {"baud": number(int, "bits", least=1, most=9600)})
    assert found == {"baud": 9600}
    assert options(urlsplit("serial:///dev/ttyUSB0"), {"baud": int}) == {}


@pytest.mark.parametrize(
    ("url", "path", "baud"),
    [
        ("serial://COM3", "COM3", 115200),
        ("SERIAL://COM12?baud=9600", "COM12", 9600),
        ("serial:COM3", "COM3", 115200),
        ("serial:///dev/ttyUSB0", "/dev/ttyUSB0", 115200),
        (
            "serial:///dev/serial/by-id/usb-Silicon_Labs_CP2102:00-port0",
            "/dev/serial/by-id/usb-Silicon_Labs_CP2102:00-port0",
            115200,
        ),
        ("serial:///dev/tty.usbserial-A1B2", "/dev/tty.usbserial-A1B2", 115200),
    ],
)
async def test_the_path_of_a_port_is_taken_as_it_is(
    url: str, path: str, baud: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str | None, int]] = []

    def take(port: serial.Serial) -> None:
        asked.append((port.port, port.baudrate))
        raise OSError("somebody else has it")

    monkeypatch.setattr(serial.Serial, "open", take)
    with pytest.raises(ConnectFailed, match="somebody else has it"):
        await open_transport(url, arm="magician")

    assert asked == [(path, baud)]


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("tcp://h:1?token=geheim", "tcp://h:1?token=..."),
        ("tcp://h:1?Token=geheim&a=1", "tcp://h:1?Token=...&a=1"),
        ("tcp://h:1?a=1&%74oken=ge heim", "tcp://h:1?a=1&%74oken=..."),
        ("tcp://h:1;token=geheim", "tcp://h:1;token=..."),
        ("tcp://h:1?a=1;token=geheim#geheim", "tcp://h:1?a=1;token=..."),
        ("ws://h:1#token=geheim?x", "ws://h:1#token=..."),
        ("ws://me:geheim@h:1?token=geheim&token=geheim", "ws://...@h:1?token=...&token=..."),
        ("zenoh://left?config=a.json5&password=geheim", "zenoh://left?config=a.json5&password=..."),
        ("tcp://h:1?token_file=/etc/token&ca=b.pem", "tcp://h:1?token_file=/etc/token&ca=b.pem"),
        ("serial:///dev/ttyUSB0?baud=115200", "serial:///dev/ttyUSB0?baud=115200"),
    ],
)
def test_a_url_is_shown_without_what_is_secret_in_it(url: str, shown: str) -> None:
    assert hidden(url) == shown


@pytest.mark.parametrize("scheme", ["tcp", "ws", "wss", "udp"])
def test_a_password_in_front_of_the_host_is_refused_and_not_shown(scheme: str) -> None:
    message = refusal(f"{scheme}://me:geheim@10.0.0.1:1")
    assert "?token=" in message
    assert "geheim" not in message


def test_a_token_in_the_wrong_place_is_not_shown_either() -> None:
    assert "geheim" not in refusal("tcp://10.0.0.1:1;token=geheim")


@pytest.mark.parametrize("content", [b"", b"two words", b"gehe\xffim", b"x" * 201, None])
def test_a_token_file_without_a_token_is_refused_and_nothing_of_it_shown(content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / "token"
    if content is not None:
        file.write_bytes(content)

    message = refusal(f"tcp://10.0.0.1:1?token_file={file}")
    assert str(file) in message
    assert "words" not in message


def test_a_token_is_given_once() -> None:
    assert "not both" in refusal("tcp://10.0.0.1:1?token=geheim&token_file=/etc/token")


def test_a_token_file_is_not_read_without_end(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_bytes(b"geheim-4711" + b" " * 5000)
    assert "has no token" in refusal(f"tcp://10.0.0.1:1?token_file={file}")


async def test_a_token_file_is_as_good_as_the_token(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(" geheim-4711\r\n")
    heard = asyncio.get_running_loop().create_future()

    async def hear(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        heard.set_result(await reader.readline())
        writer.close()

    server = await asyncio.start_server(hear, "127.0.0.1", 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        transport = await open_transport(f"tcp://127.0.0.1:{port}?token_file={file}", arm="magician")
        assert await heard == b"TOKEN geheim-4711\n"
        await transport.aclose()
