"""The blocking classes are the asynchronous ones without await: the same names, arguments, defaults and types."""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typed_program
import write_sync

import dobot_async
from dobot_async import sync
from dobot_async.arms.ultraarm.gcode import GCodeRun
from dobot_async.fleet import Fleet, Together
from dobot_async.simulator import Simulation, simulate
from dobot_async.sync import fleet, link, magician, mycobot, simulation, streams, together, twins, ultraarm

PAIRS: dict[type[Any], type[Any]] = {
    **{twin.kind: getattr(sync_page, twin.called) for sync_page, twin in write_sync.pages()},
    dobot_async.Link: link.Link,
    Fleet: fleet.Fleet,
    Together: together.Together,
    Simulation: simulation.Simulation,
    GCodeRun: streams.GCodeRun,
}
INTERNAL = write_sync.INTERNAL | {"motions", "batches", "client", "entry", "connect", "pump"}
NOT_THERE: dict[type[Any], set[str]] = {
    # The wire itself is for the driver; what users see of a link is there.
    dobot_async.Link: {
        *(
            "abandon",
            "exchange",
            "frame",
            "opened",
            "reorder_window",
            "reply_timeout",
            "request",
            "send",
            "send_nowait",
            "settle",
            "slot",
            "turn",
        ),
        *("barrier", "sent_nowait"),
    },
    dobot_async.Motion: {"accept", "end"},
    dobot_async.following.Follow: {"begun", "check", "close", "run"},
}
WAITS = (
    (r"Coroutine\[Any, Any, (.*)\]", r"\1"),
    (r"Async(Iterator|Generator)\[(.*?)(, None)?\]", r"Items[\2]"),
    (r"AbstractAsyncContextManager\[(.*)\]", r"AbstractContextManager[\1]"),
)


def pairs() -> Iterator[tuple[type[Any], type[Any], str]]:
    """Each public method or property of each class."""
    for kind, twin in PAIRS.items():
        for name in dir(kind):
            if not name.startswith("_") and name not in INTERNAL | NOT_THERE.get(kind, set()):
                yield kind, twin, name


each_member = pytest.mark.parametrize(
    ("kind", "twin", "name"), list(pairs()), ids=lambda value: value if isinstance(value, str) else value.__name__
)


def parameters(function: Any) -> list[tuple[str, Any, Any]]:
    """The parameters of a method, but for those that users never give."""
    found = inspect.signature(function).parameters.values()
    return [(each.name, each.kind, each.default) for each in found if each.name not in write_sync.HIDDEN]


@each_member
def test_a_member_is_there_with_the_same_arguments_and_defaults(kind: type[Any], twin: type[Any], name: str) -> None:
    original, blocking = inspect.getattr_static(kind, name), inspect.getattr_static(twin, name)
    if isinstance(original, property) or not callable(getattr(kind, name)):
        assert isinstance(blocking, property)
        return

    assert parameters(getattr(twin, name)) == parameters(getattr(kind, name))
    assert not inspect.iscoroutinefunction(getattr(twin, name))
    assert not inspect.isasyncgenfunction(getattr(twin, name))


@each_member
def test_a_member_returns_what_the_other_one_gives_when_it_is_awaited(
    kind: type[Any], twin: type[Any], name: str
) -> None:
    original, blocking = (inspect.getattr_static(each, name) for each in (kind, twin))
    read = isinstance(original, property)
    if not read and not callable(getattr(kind, name)):
        return  # an attribute: its type is where it is set

    functions = [getattr(each, "fget" if read else "__func__", each) for each in (original, blocking)]
    given, found = (getattr(each, "__annotations__", {}).get("return") for each in functions)
    if functions[0] is functions[1]:
        return  # a verb: what it returns is its class's T

    assert found, "not typed"
    if kind is GCodeRun or name in {
        "each",
        "run",
        "together",
        "stream",
        "start",
        "connect",
        "from_file",
        "state",
        "events",
    }:
        return  # overloaded, or another class: tests of the types look at these

    wanted = str(given)
    if hasattr(original, "__wrapped__"):  # a block
        wanted = re.sub(r"^Async(Iterator|Generator)\[(.*?)(, None)?\]$", r"AbstractContextManager[\2]", wanted)

    for pattern, without in WAITS:
        wanted = re.sub(pattern, without, wanted)

    assert found == wanted


@each_member
def test_a_member_says_the_same_in_words_without_await(kind: type[Any], twin: type[Any], name: str) -> None:
    said = inspect.getdoc(getattr(twin, name))
    member = inspect.getattr_static(kind, name)  # the value of an attribute has words of its own, even if it is None
    original = (inspect.getdoc(member) or "") if isinstance(member, property) or callable(getattr(kind, name)) else ""
    assert said
    assert "await " not in said
    assert "async " not in said
    assert not original or said.split()[0] == original.split()[0]


each_function = pytest.mark.parametrize(
    ("page", "name", "original"), [pytest.param(*each, id=each[1]) for each in write_sync.functions()]
)
NO_TWIN = {
    # The wire is for the driver, and a base class or a strategy for those who write one.
    "open_transport": "the wire",
    "Arm": "a protocol: its verbs are those of each blocking arm",
    **dict.fromkeys(("DiscoverySource", "Transport"), "a protocol: written for the driver's own loop"),
    "Strategy": "a protocol: written for the driver's own loop",
    "follow_target": "arm.following",
    # Who serves others is a program of its own: there is a command for each, and `run` awaits anything.
    **dict.fromkeys(("Bridge", "bridge", "figures_of_bridge"), "dobot-async bridge"),
    **dict.fromkeys(("ArmServer", "serve_http", "serve_stdio"), "dobot-async mcp"),
    **dict.fromkeys(("Action", "Draw", "Grip", "Home", "Move", "Pick", "Place", "Recover"), "dobot-async mcp, mqtt"),
    **dict.fromkeys(("Works", "open_site", "state_told"), "dobot-async mcp, mqtt"),
    "Gateway": "dobot-async mqtt",
    "serve_metrics": "dobot-async bridge, mqtt: --metrics",
    "announced": "dobot-async simulate --announce",
}
"""What is awaited and public, and has no blocking twin: why."""


def awaited_and_public() -> Iterator[tuple[str, str]]:
    """The package and the name of each public function and class of which something is awaited."""
    without = {"cli", "compat", "panel", "sync", "testing"}
    names = [found.name for found in pkgutil.iter_modules(dobot_async.__path__) if found.name not in without]
    modules = [import_module(f"dobot_async.{name}") for name in names if not name.startswith("_")]
    for package in (dobot_async, *modules):
        for name in getattr(package, "__all__", ()):
            if is_awaited(getattr(package, name)):
                yield package.__name__, name


def is_awaited(value: Any) -> bool:
    """Whether a function, or one that a class has itself, is to be awaited, or entered or iterated over so."""
    if inspect.isclass(value):
        return any(
            is_awaited(each) for name, each in vars(value).items() if name[0] != "_" and inspect.isfunction(each)
        )

    returned = str(getattr(value, "__annotations__", {}).get("return", "")) if inspect.isfunction(value) else ""
    return (
        inspect.iscoroutinefunction(value) or re.match("Async|AbstractAsync|Coroutine|Awaitable", returned) is not None
    )


@pytest.mark.parametrize(("package", "name"), list(awaited_and_public()))
def test_whatever_is_awaited_has_a_blocking_twin(package: str, name: str) -> None:
    assert (name in sync.__all__) is (name not in NO_TWIN), package


def test_who_has_no_twin_is_still_there() -> None:
    assert NO_TWIN.keys() <= {name for _, name in awaited_and_public()}


@each_function
def test_a_function_has_the_same_arguments_and_defaults(page: ModuleType, name: str, original: Any) -> None:
    function = getattr(sync, name)
    assert function is getattr(page, name)
    assert parameters(function) == parameters(original)
    assert not inspect.iscoroutinefunction(function)
    assert not inspect.isasyncgenfunction(function)


@each_function
def test_a_function_says_the_same_in_words_without_await(page: ModuleType, name: str, original: Any) -> None:
    said, first = inspect.getdoc(getattr(page, name)) or "", (inspect.getdoc(original) or "").splitlines()[0]
    assert said.splitlines()[0] == first
    assert "await " not in said
    assert "async " not in said
    assert "cancelled" not in said


@pytest.mark.parametrize("twin", [twin for _, twin in write_sync.pages() if twin.made], ids=lambda twin: twin.called)
def test_what_users_make_is_made_of_the_same(twin: write_sync.Twin) -> None:
    assert parameters(getattr(sync, twin.called)) == parameters(twin.kind)


@pytest.mark.parametrize("kind", [magician.Magician, mycobot.MyCobot, ultraarm.UltraArm, fleet.Fleet])
def test_connect_takes_what_the_asynchronous_one_takes(kind: type[Any]) -> None:
    original = Fleet if kind is fleet.Fleet else twins.asynchronous_of(kind)
    assert parameters(kind.connect) == parameters(original.connect)
    assert parameters(sync.simulate) == parameters(simulate)


@pytest.mark.parametrize("family", ["magician", "mycobot", "ultraarm"])
def test_attributes_that_the_asynchronous_arm_documents_are_there(family: str) -> None:
    for kind, twin in PAIRS.items():
        documented = write_sync.parted(inspect.getdoc(kind) or "")[1]
        if family in kind.__module__ and "queue" in documented:
            assert documented.keys() <= set(dir(twin)), kind


def test_the_written_modules_are_what_the_generator_writes() -> None:
    for path, text in write_sync.generated().items():
        assert path.read_text(encoding="utf-8") == text, f"run python tests/sync/write_sync.py: {path.name}"


def test_the_names_of_the_stub_are_those_of_the_package() -> None:
    stub = Path(sync.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    names = re.findall(r'^    "(\w+)",$', stub, re.MULTILINE)
    assert names == sync.__all__
    assert all(hasattr(sync, name) for name in names)
    with pytest.raises(AttributeError, match="nonsense"):
        getattr(sync, "nonsense")  # noqa: B009 - which type checkers would refuse


def test_a_typed_program_runs() -> None:
    typed_program.program()
