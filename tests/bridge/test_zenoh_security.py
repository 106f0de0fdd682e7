"""The configuration files in examples/zenoh keep out who has no credentials; they are tried as they are."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
import trustme
import zenoh
from bridge_rig import Rig, bridged, until
from zenoh_rig import configured, endpoint, keep, warm_up

from dobot_async import ConnectFailed, Magician
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import encode, request
from dobot_async.transports import open_transport
from dobot_async.transports.zenoh.messages import DATA, HEADER

FILES = Path(__file__).parents[2] / "examples" / "zenoh"
JOG = encode(request(c.SET_JOG_CMD, c.SET_JOG_CMD.request.encode(c.JOGCmd(False, c.JOGKey.AP_DOWN)), queued=False))


@pytest.fixture(scope="module", autouse=True)
def runtime() -> None:
    warm_up()


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The files, and what they name, in the current directory."""
    for file in FILES.iterdir():
        shutil.copy(file, tmp_path)

    (tmp_path / "zenoh-users.txt").write_text("operator:correct-horse\nwatcher:battery-staple\n")
    authority, other = trustme.CA(), trustme.CA()
    authority.cert_pem.write_to_path(tmp_path / "ca.pem")
    other.cert_pem.write_to_path(tmp_path / "other-ca.pem")
    for name, issuer, identity in (
        ("server", authority, "localhost"),
        ("client", authority, "operator.test"),
        ("stranger", other, "operator.test"),
    ):
        issued = issuer.issue_cert(identity, common_name=identity)
        issued.private_key_pem.write_to_path(tmp_path / f"{name}-key.pem")
        for pem in issued.cert_chain_pems[:1]:
            pem.write_to_path(tmp_path / f"{name}.pem")

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ZENOH_CONFIG", raising=False)
    return tmp_path


@asynccontextmanager
async def served(kind: str, where: str) -> AsyncIterator[Rig]:
    """An arm that is served with one of the files, on this computer alone."""
    async with bridged(f"zenoh://left?config={kind}-server.json5&listen={where}") as rig:
        yield rig


def client_file(kind: str, name: str, **settings: object) -> str:
    """A client's file that differs in some things."""
    config = zenoh.Config.from_file(f"{kind}-client.json5")
    Path(name).write_text(str(configured(config, mode="client", **settings)))
    return name


async def moves(url: str, rig: Rig) -> None:
    """Moves the arm."""
    async with Magician.connect(url) as arm:
        await arm.move_to(220, 0, 40)

    assert rig.executed(c.SET_PTP_CMD)


async def is_kept_out(url: str, rig: Rig) -> str:
    """Why an arm cannot be moved."""
    with pytest.raises(ConnectFailed) as refused:
        async with Magician.connect(url):
            pass

    assert not rig.executed(c.SET_PTP_CMD)
    assert not rig.told("connected")
    return str(refused.value)


# --- access control ---


async def test_who_has_the_password_may_move_the_arm() -> None:
    where = endpoint()
    async with served("access", where) as rig:
        await moves(f"zenoh://left?config=access-client.json5&connect={where}", rig)


@pytest.mark.parametrize(
    ("user", "password"), [("operator", "wrong"), ("operator", "battery-staple"), ("nobody", "correct-horse")]
)
async def test_a_wrong_password_is_kept_out(user: str, password: str) -> None:
    where = endpoint()
    async with served("access", where) as rig:
        file = client_file("access", "wrong.json5", transport__auth__usrpwd={"user": user, "password": password})
        await is_kept_out(f"zenoh://left?config={file}&connect={where}", rig)


async def test_who_has_no_password_is_kept_out() -> None:
    where = endpoint()
    async with served("access", where) as rig:
        await is_kept_out(f"zenoh://left?connect={where}", rig)
        with pytest.raises(zenoh.ZError):
            await asyncio.to_thread(zenoh.open, configured(connect__endpoints=[where]))


async def test_a_watcher_sees_everything_and_cannot_move_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    where = endpoint()
    watcher = {"user": "watcher", "password": "battery-staple"}
    async with served("access", where) as rig:
        file = client_file("access", "watcher.json5", transport__auth__usrpwd=watcher, connect__endpoints=[where])
        with monkeypatch.context() as hurried:
            hurried.setattr("dobot_async.transports.zenoh.transport.LET_IN", 0.2)  # it asks in vain until then
            reason = await is_kept_out(f"zenoh://left?config={file}", rig)

        assert "does Zenoh's access control allow" in reason

        mover = f"zenoh://left?config=access-client.json5&connect={where}"
        async with Magician.connect(mover) as arm, watching(file) as own:
            kept = keep(own, "dobot/**")
            overheard = keep(own, "dobot/*/@link/**")
            await arm.move_to(220, 0, 40)
            await until(lambda: {key for key, _ in kept} >= {"dobot/left/pose", "dobot/left/link"})
            await arm.get_pose()
            assert not overheard
            assert not await links(file)

            (link,) = await links(client_file("access", "operator.json5", connect__endpoints=[where]))
            for number in range(1000):
                own.put(f"{link}/up", HEADER.pack(number, DATA) + JOG)

            await arm.get_pose()
            await arm.move_to(230, 0, 40)
            assert {each.command for each in rig.sim.arm.executed} & {c.SET_JOG_CMD} == set()


async def test_a_watcher_cannot_pass_for_an_arm_and_lock_out_who_may_move_it() -> None:
    where = endpoint()
    watcher = {"user": "watcher", "password": "battery-staple"}
    async with served("access", where) as rig:
        file = client_file("access", "watcher.json5", transport__auth__usrpwd=watcher, connect__endpoints=[where])
        async with watching(file) as own:
            (arm,) = await arms(own)
            tokens = [own.liveliness().declare_token(key) for key in (arm, "dobot/left/@arm/magician/fa15e")]
            overheard = keep(own, "dobot/left/@link/**")
            await moves(f"zenoh://left?config=access-client.json5&connect={where}", rig)
            assert not overheard
            for token in tokens:
                token.undeclare()  # type: ignore[no-untyped-call]


async def arms(own: zenoh.Session) -> list[str]:
    """The keys of the arms that a session sees."""
    tokens = await asyncio.to_thread(lambda: list(own.liveliness().get("dobot/left/@arm/**", timeout=0.5)))
    return [str(reply.ok.key_expr) for reply in tokens if reply.ok]


async def links(file: str) -> list[str]:
    """The keys of those who are connected to the arm, as far as a session may see them."""
    async with watching(file) as own:
        tokens = await asyncio.to_thread(lambda: list(own.liveliness().get("dobot/left/@link/*", timeout=0.5)))
        return [str(reply.ok.key_expr) for reply in tokens if reply.ok]


@asynccontextmanager
async def watching(file: str) -> AsyncIterator[zenoh.Session]:
    """A session that speaks no more than Zenoh, with a file of its own."""
    own = await asyncio.to_thread(zenoh.open, zenoh.Config.from_file(file))
    try:
        yield own
    finally:
        await asyncio.to_thread(own.close)


# --- TLS ---


def secured(where: str) -> str:
    """The endpoint, by the name that is in the certificate."""
    return where.replace("127.0.0.1", "localhost")


async def test_who_has_a_certificate_may_move_the_arm() -> None:
    where = endpoint("tls")
    async with served("tls", where) as rig:
        await moves(f"zenoh://left?config=tls-client.json5&connect={secured(where)}", rig)


@pytest.mark.parametrize(
    "settings",
    [
        {"transport__link__tls__connect_certificate": "stranger.pem"}
        | {"transport__link__tls__connect_private_key": "stranger-key.pem"},
        {"transport__link__tls__connect_certificate": None, "transport__link__tls__connect_private_key": None},
        {"transport__link__tls__root_ca_certificate": "other-ca.pem"},
    ],
    ids=["another authority", "no certificate", "another server is expected"],
)
async def test_who_has_no_certificate_or_a_wrong_one_is_kept_out(settings: dict[str, object]) -> None:
    where = endpoint("tls")
    async with served("tls", where) as rig:
        file = client_file("tls", "wrong.json5", **settings)
        await is_kept_out(f"zenoh://left?config={file}&connect={secured(where)}", rig)


async def test_a_certificate_for_another_host_is_not_trusted() -> None:
    where = endpoint("tls")
    async with served("tls", where) as rig:
        await is_kept_out(f"zenoh://left?config=tls-client.json5&connect={where}", rig)


async def test_who_speaks_no_tls_is_kept_out() -> None:
    where = endpoint("tls")
    async with served("tls", where) as rig:
        await is_kept_out(f"zenoh://left?connect={where.replace('tls', 'tcp')}", rig)
        transport = await open_transport(
            f"zenoh://left?config=tls-client.json5&connect={secured(where)}", arm="magician"
        )
        await transport.aclose()
