"""Writes the blocking classes of `dobot_async.sync` out of the asynchronous ones: python tests/sync/write_sync.py

    class of the driver --> its public members, as they stand in the source
        async def f(...) -> R              def f(...) -> R                              waits
        async context manager of R         def f(...) -> AbstractContextManager[R]      a block
        async generator of R               def f(...) -> Iterator[R]                    for `for`
        def f(...) -> R, property          the same                                     looked at in the arms' thread
    function of the driver --> the same, but that one which only looks what arm it is runs in the thread of who calls it
    docstrings, names, defaults and types stay; a class that has a blocking twin itself is replaced by that, and what is
    given to a function (an arm, a tool, a check) is what programs without asyncio have of it.

A test compares what this writes with what is in the repository.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

ROOT = Path(__file__).parents[2]
PACKAGE = "dobot_async.sync"
INTERNAL = frozenset(
    (
        *("aclose", "attach", "begin_own_stop", "begin_stop", "beside", "cancel_writer", "count", "declared"),
        *("exclusively", "fail", "find_goal", "give_up", "goal", "greet", "kept", "leads_anywhere", "leave"),
        *("led_by", "look", "next", "note", "on_motion"),
        *("no_more_room", "perform", "perform_from_goal", "planned", "prepare", "put_all", "rest", "unplanned_motion"),
        *("stopping", "stops_heard", "update", "watch", "watching", "write_on", "writer_ended"),
    )
)
"""Public by their names, and nobody's verbs: what one part of the driver calls of another one."""

HIDDEN = ("epoch",)
"""Arguments that one part of the driver gives to another one."""


@dataclass(frozen=True)
class Twin:
    """A class to be written.

    Attributes:
        of: The asynchronous class, "module:name".
        name: Of the blocking one; by default the same.
        verbs: What the verbs return in its place, "" where it has none.
        members: Its attributes that have twins, with those.
        calls: Its attributes that are called, each with the class that says how.
        reads: Its other attributes, with their types.
        copies: Attributes that its verbs look at.
        about: What the class is, where the asynchronous one says it in words that do not fit.
        omit: What is written by hand, or is not there.
        base: What is written by hand of it.
        made: Users make it themselves, of what the asynchronous one is made of.
    """

    of: str
    name: str = ""
    verbs: str = ""
    members: dict[str, str] = field(default_factory=dict)
    calls: dict[str, str] = field(default_factory=dict)
    reads: dict[str, str] = field(default_factory=dict)
    copies: tuple[str, ...] = ()
    about: str = ""
    omit: tuple[str, ...] = ()
    base: str = ""
    made: bool = False

    @property
    def kind(self) -> type[Any]:
        """The asynchronous class."""
        kind: type[Any] = found(self.of)
        return kind

    @property
    def called(self) -> str:
        """The blocking one's name."""
        return self.name or self.kind.__name__


def found(path: str) -> Any:
    """What a path leads to."""
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class Page:
    """A module to be written."""

    about: str
    twins: Sequence[Twin] = ()
    functions: Sequence[str] = ()


@dataclass(frozen=True)
class Given:
    """What a function is given, in the words of programs without asyncio.

    Attributes:
        called: Its type, "module:name" of the blocking package; "" for the one that it has.
        taken: What makes the asynchronous one of it.
        told: What makes it of an asynchronous one that is returned.
    """

    called: str
    taken: str
    told: str = ""


GIVEN = {
    "dobot_async.arms.base:Arm": Given("twins:AnyArm", "given:arm_of"),
    "dobot_async.toolpath.drawing:DrawingArm": Given("twins:AnyArm", "given:arm_of"),
    "dobot_async:MyCobot": Given("mycobot:MyCobot", "given:arm_of"),
    "dobot_async.handling.pick_and_place:Tool": Given("given:Tool", "given:tool_of"),
    "dobot_async.handling.arms:Check": Given("given:Check", "given:check_of", "given:blocking"),
}
"""By the type that the asynchronous function says."""

LIKE_AN_ARM = Given("", "given:like_an_arm")
"""An `arm` that may be something else as well, such as the name of a model."""

ARM = {"link": "Link"}
WRITTEN = ("stream",)
MOTION = """One queued command; any number of threads may wait for it.

`wait` returns when the arm has executed it, and raises ArmAlarm, MotionStopped, MotionUnknown or ConnectionLost
when it has not. It belongs to its queue: interrupting who waits for it only ends the waiting."""

PAGES: dict[str, Page] = {
    "magician": Page(
        "A Dobot Magician, for programs without asyncio.",
        (
            Twin("dobot_async.arms.magician.queue:Batch", verbs="Motion", base="BatchTwin"),
            Twin("dobot_async.arms.magician.queue:Download", verbs="Motion", base="BatchTwin"),
            Twin(
                "dobot_async.arms.magician.queue:MagicianQueue",
                verbs="Motion",
                base="QueueTwin",
                reads={"kinematics": "Kinematics"},
                omit=WRITTEN,
            ),
            Twin("dobot_async.arms.magician.wifi:WiFi"),
            Twin(
                "dobot_async:Magician",
                verbs="None",
                base="ArmTwin",
                members={**ARM, "queue": "MagicianQueue", "wifi": "WiFi"},
                calls={"following": "dobot_async.arms.magician.following:MagicianFollowing"},
            ),
        ),
    ),
    "mycobot": Page(
        "An arm of the myCobot family, for programs without asyncio.",
        (
            Twin("dobot_async.arms.mycobot.queue:CobotBatch", verbs="Motion", base="BatchTwin"),
            Twin("dobot_async.arms.mycobot.queue:CobotQueue", verbs="Motion", base="QueueTwin", omit=WRITTEN),
            Twin(
                "dobot_async:MyCobot",
                verbs="None",
                base="ArmTwin",
                members={**ARM, "queue": "CobotQueue"},
                calls={"following": "dobot_async.arms.mycobot.following:CobotFollowing"},
            ),
        ),
    ),
    "ultraarm": Page(
        "An ultraArm P340, for programs without asyncio.",
        (
            Twin("dobot_async.arms.ultraarm.queue:UltraArmBatch", verbs="Motion", base="BatchTwin", copies=("pump",)),
            Twin(
                "dobot_async.arms.ultraarm.queue:UltraArmQueue",
                verbs="Motion",
                base="QueueTwin",
                copies=("pump",),
                omit=WRITTEN,
            ),
            Twin(
                "dobot_async:UltraArm",
                verbs="None",
                base="ArmTwin",
                members={**ARM, "queue": "UltraArmQueue"},
                calls={"following": "dobot_async.arms.ultraarm.following:UltraArmFollowing"},
                reads={"limits": "c.UltraArmLimits"},
                copies=("pump",),
            ),
        ),
    ),
    "motion": Page(
        "A queued command, for programs without asyncio.",
        (
            Twin(
                "dobot_async:Motion",
                base="MotionTwin",
                about=MOTION,
                reads={"name": "str", "moves": "bool", "index": "int | None"},
                omit=("accept", "end", "done"),
            ),
        ),
    ),
    "follow": Page(
        "What a program without asyncio holds while an arm follows a target.",
        (
            Twin(
                "dobot_async.following:Follow",
                members={"motion": "Motion"},
                reads={"sent": "int"},
                omit=("run", "begun", "close", "check"),
            ),
        ),
    ),
    "handling": Page(
        "Pick and place, for programs without asyncio.",
        functions=[f"dobot_async.handling:{name}" for name in ("gripper_holds", "pick", "pick_and_place", "place")],
    ),
    "toolpath": Page(
        "Drawing and engraving, for programs without asyncio.",
        (Twin("dobot_async.toolpath:Drawing", made=True),),
        (
            "dobot_async.toolpath:draw",
            "dobot_async.toolpath:engrave",
            "dobot_async.toolpath:estimate",
            "dobot_async.toolpath:check_toolpath",
            "dobot_async.toolpath:reach_of",
            "dobot_async.toolpath:reachable",
        ),
    ),
    "teaching": Page(
        "Teaching and playing back, for programs without asyncio.",
        (Twin("dobot_async.teaching:Recorder", reads={"arm": "twins:AnyArm"}, made=True),),
        (
            "dobot_async.teaching:check_recording",
            "dobot_async.teaching:play",
            "dobot_async.teaching:released",
        ),
    ),
    "discovery": Page("Search for arms, for programs without asyncio.", functions=("dobot_async.discovery:discover",)),
    "figures": Page(
        "Figures of arms, for programs without asyncio.",
        functions=("dobot_async.metrics:figures_of", "dobot_async.metrics:read_figures"),
    ),
}
BY_HAND = {
    "dobot_async:Link": ("link", "Link"),
    "dobot_async.arms.ultraarm.gcode:GCodeRun": ("streams", "GCodeRun"),
}


def homes() -> dict[type[Any], tuple[str, str]]:
    """The module and the name of the twin of each class that has one."""
    written = {twin.kind: (page, twin.called) for page, each in PAGES.items() for twin in each.twins}
    return written | {found(path): home for path, home in BY_HAND.items()}


def twin_homes() -> dict[str, str]:
    """The module of each twin, by its name."""
    return {name: page for page, name in homes().values()}


def functions() -> Iterator[tuple[ModuleType, str, Any]]:
    """Each function that is written, with the module that it is in, and the asynchronous one."""
    for name, page in PAGES.items():
        for path in page.functions:
            yield import_module(f"{PACKAGE}.{name}"), path.partition(":")[2], found(path)


def pages() -> Iterator[tuple[ModuleType, Twin]]:
    """Each class that is written, with the module that it is in."""
    for name, page in PAGES.items():
        for twin in page.twins:
            yield import_module(f"{PACKAGE}.{name}"), twin


class Source:
    """A module of the driver, as far as its names are concerned."""

    def __init__(self, module: ModuleType) -> None:
        self.module = module
        self.tree = ast.parse(inspect.getsource(module))
        self.imported: dict[str, tuple[str, str]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    self.imported[alias.asname or alias.name] = (node.module, alias.name)

    def body(self, kind: type[Any]) -> ast.ClassDef:
        """The source of a class."""
        (node,) = [each for each in self.tree.body if isinstance(each, ast.ClassDef) and each.name == kind.__name__]
        return node

    def function(self, name: str) -> ast.FunctionDef | ast.AsyncFunctionDef:
        """The source of a function."""
        kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
        (node,) = [each for each in self.tree.body if isinstance(each, kinds) and each.name == name]
        return node


class Writer:
    """Writes one module."""

    def __init__(self, page: str) -> None:
        self.page = page
        self.homes = homes()
        self.imports: set[tuple[str, str, str]] = set()
        self.variables: dict[str, TypeVar] = {}
        self.sources: dict[str, Source] = {}

    def written(self) -> str:
        """The text of the module."""
        about = PAGES[self.page]
        classes = [self.twin(twin) for twin in about.twins]
        classes += [self.function(path) for path in about.functions]
        names = sorted([twin.called for twin in about.twins] + [path.partition(":")[2] for path in about.functions])
        lines = [
            f'"""{about.about}',
            "",
            'Written by tests/sync/write_sync.py: change what that reads, and run it again.\n"""',
            "",
        ]
        lines += ["from __future__ import annotations", ""]
        if self.variables:
            self.need("typing", "TypeVar")

        lines += [self.import_line(*each) for each in sorted(self.imports)]
        lines += ["", f"__all__ = {names!r}", ""]
        lines += [f'{name} = TypeVar("{name}")' for name in sorted(self.variables)]
        return "\n".join([*lines, "", *classes])

    @staticmethod
    def import_line(module: str, name: str, alias: str) -> str:
        """An import."""
        return f"from {module} import {name}" + (f" as {alias}" if alias != name else "")

    def need(self, module: str, name: str, alias: str = "") -> str:
        """Import a name; return what it is called."""
        self.imports.add((module, name, alias or name))
        return alias or name

    def sync(self, module: str, name: str) -> str:
        """Import a name of the blocking package; return it."""
        return name if module == self.page else self.need(f"{PACKAGE}.{module}", name)

    def source(self, name: str) -> Source:
        """A module of the driver."""
        if name not in self.sources:
            self.sources[name] = Source(import_module(name))

        return self.sources[name]

    def twin(self, twin: Twin) -> str:
        """The text of a class."""
        kind = twin.kind
        original = self.need(kind.__module__, kind.__name__, f"Async{twin.called}")
        bases = [self.base(twin, original)]
        if twin.verbs:
            verbs = next(each for each in kind.__mro__ if each.__name__ == "Verbs")
            value = self.sync("motion", "Motion") if twin.verbs == "Motion" else "None"
            bases.append(f"{self.need(verbs.__module__, 'Verbs')}[{value}]")

        about, attributes = parted(inspect.getdoc(kind) or "")
        lines = [f"class {twin.called}({', '.join(bases)}):", self.docstring(twin.about or about)]
        if twin.copies:
            lines += ["", *self.copies(twin, original)]

        if twin.made:
            lines += ["", *self.constructor(kind, original)]

        for name, of in (twin.members | twin.reads).items():
            value, wrap = of, ""
            if name in twin.members:
                value = wrap = self.sync(twin_homes()[of], of)
            elif ":" in of:  # whichever family's
                value, wrap = self.sync(*of.split(":")), self.sync("twins", "twin_of")
            else:
                self.expression(ast.parse(of, mode="eval").body, self.source(kind.__module__))

            read = f"self.asynchronous.{name}"
            lines += ["", "    @property", f"    def {name}(self) -> {value}:"]
            lines += [self.docstring(attributes[name], "        ")]
            if ":" in of:
                lines += [f"        found: {value} = {wrap}({read})", "        return found"]
            else:
                lines += [f"        return {f'{wrap}({read})' if wrap else read}"]

        for node, source in self.members(twin):
            lines += ["", *self.member(node, source, f"self.asynchronous.{node.name}", original, twin)]

        for name, path in twin.calls.items():
            of = found(path)
            source = self.source(of.__module__)
            (called,) = [each for each in source.body(of).body if getattr(each, "name", "") == "__call__"]
            assert isinstance(called, ast.FunctionDef)
            lines += ["", *self.member(called, source, f"self.asynchronous.{name}", original, twin, name)]

        return "\n".join([*lines, "", ""])

    def copies(self, twin: Twin, original: str) -> list[str]:
        """The lines that take over attributes."""
        lines = [f"    def __init__(self, asynchronous: {original}) -> None:", "        super().__init__(asynchronous)"]
        for name in twin.copies:
            holder = next(each for each in twin.kind.__mro__ if name in inspect.get_annotations(each))
            of = self.need(holder.__module__, inspect.get_annotations(holder)[name])
            lines += [f"        self.{name}: {of} = asynchronous.{name}"]

        return lines

    def constructor(self, kind: type[Any], original: str) -> list[str]:
        """The lines of what users make one by."""
        source = self.source(kind.__module__)
        (node,) = [each for each in source.body(kind).body if getattr(each, "name", "") == "__init__"]
        assert isinstance(node, ast.FunctionDef)
        doc, call = (
            self.docstring(ast.get_docstring(node) or "", "        "),
            f"{original}({self.given(node.args, source)})",
        )
        return [
            f"    def __init__({self.arguments(node.args, source)}) -> None:",
            *([doc] if doc else []),
            f"        super().__init__({call})",
        ]

    def function(self, path: str) -> str:
        """The text of a function."""
        module, _, name = path.partition(":")
        source = self.source(found(path).__module__)
        node = source.function(name)
        target = self.need(module, name, f"async_{name}")
        given = self.given(node.args, source)
        words = {ast.unparse(each) for each in node.decorator_list}
        kind, inner = self.kind_of(node, words)
        text, body = self.returned(node, source, words, False, target, given, False)
        if kind == "look" and LIKE_AN_ARM.taken.partition(":")[2] in given:  # it asks no arm, and may take a while
            body = [f"        {'' if text == 'None' else 'return '}{target}({given})"]
        elif kind == "items":  # nothing else may be open meanwhile
            body = [line.replace("return Items(", f"return {self.sync('twin', 'held')}(Items(") + ")" for line in body]
            text = f"{self.need('collections.abc', 'Generator')}[{self.type_of(inner, source)[0]}, None, None]"

        doc = self.docstring(ast.get_docstring(node) or "", "        ")
        return textwrap.dedent(
            "\n".join([f"    def {name}({self.arguments(node.args, source)}) -> {text}:", doc, *body, "", ""])
        )

    def given(self, node: ast.arguments, source: Source) -> str:
        """The arguments of a call that hands all on, as the asynchronous function takes them."""
        taken = {}
        for each in (*node.posonlyargs, *node.args, *node.kwonlyargs):
            given = self.given_as(each.annotation, source) or (LIKE_AN_ARM if each.arg == "arm" else None)
            if given:
                taken[each.arg] = self.sync(*given.taken.split(":"))

        return call_of(node, taken)

    @staticmethod
    def given_as(node: ast.expr | None, source: Source) -> Given | None:
        """What programs without asyncio have instead of something of this type, which may be None."""
        while isinstance(node, ast.BinOp):
            node = node.left

        value = getattr(source.module, node.id, None) if isinstance(node, ast.Name) else None
        return next((given for path, given in GIVEN.items() if value is not None and found(path) is value), None)

    def base(self, twin: Twin, original: str) -> str:
        """The class that holds the asynchronous object."""
        if twin.base == "MotionTwin":
            return self.sync("motion_base", twin.base)

        return f"{self.sync('bases', twin.base) if twin.base else self.sync('twin', 'Twin')}[{original}]"

    def members(self, twin: Twin) -> Iterator[tuple[ast.FunctionDef | ast.AsyncFunctionDef, Source]]:
        """The public methods of a class and of what it inherits, but for verbs, which are inherited as they are."""
        seen = {*INTERNAL, *twin.omit, *twin.members, *twin.calls, *twin.reads}
        for kind in twin.kind.__mro__:
            if not kind.__module__.startswith("dobot_async") or (twin.verbs and kind.__name__.endswith("Verbs")):
                continue

            source = self.source(kind.__module__)
            here = set()
            for node in source.body(kind).body:
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("_"):
                    words = {ast.unparse(each) for each in node.decorator_list}
                    if node.name not in seen and "overload" not in words:
                        here.add(node.name)
                        yield node, source

            seen |= here

    def member(
        self,
        node: ast.FunctionDef | ast.AsyncFunctionDef,
        source: Source,
        target: str,
        original: str,
        twin: Twin,
        name: str = "",
    ) -> list[str]:
        """The lines of a method."""
        words = {ast.unparse(each) for each in node.decorator_list}
        name = name or node.name
        head: list[str] = []
        setter = f"{node.name}.setter" in words
        if "property" in words:
            head = ["    @property"]
        elif setter:
            head = [f"    @{node.name}.setter"]
        elif "classmethod" in words:
            head, target = ["    @classmethod"], f"{original}.{node.name}"

        arguments = self.arguments(node.args, source)
        given = call_of(node.args)
        returned = self.returned(node, source, words, "property" in words, target, given, setter)
        doc = self.docstring(ast.get_docstring(node) or "", "        ")
        result = f" -> {returned[0]}" if returned[0] else ""
        return [*head, f"    def {name}({arguments}){result}:", *([doc] if doc else []), *returned[1]]

    def returned(
        self,
        node: ast.FunctionDef | ast.AsyncFunctionDef,
        source: Source,
        words: set[str],
        is_property: bool,
        target: str,
        given: str,
        setter: bool,
    ) -> tuple[str, list[str]]:
        """The annotation of what a method returns, and its body."""
        portal = self.sync("portal", "PORTAL")
        if setter:
            name, value = node.name, node.args.args[1].arg
            return "None", [f'        {portal}.look(lambda: setattr(self.asynchronous, "{name}", {value}))']

        assert node.returns, node.name
        kind, inner = self.kind_of(node, words)
        if is_property:
            text, wrap = self.type_of(inner, source)
            return text, [f"        return {f'{wrap}({target})' if wrap else target}"]

        text, wrap = self.type_of(inner, source)
        call = f"{target}({given})"
        if kind == "block":
            block, manager = self.sync("twin", "BlockingContext"), self.need("contextlib", "AbstractContextManager")
            wrap = "cls" if text == "Self" else wrap or self.sync("twin", "same")
            name = "str(url)" if text == "Self" else repr(node.name)
            return f"{manager}[{text}]", [f"        return {block}(lambda: {call}, {wrap}, {name})"]

        if kind == "items":
            items = self.sync("twin", "Items")
            make = call.removesuffix("()") if call.endswith("()") else f"lambda: {call}"
            return f"{items}[{text}]", [f"        return {items}({make}, {wrap or self.sync('twin', 'same')})"]

        verb = "run" if kind == "wait" else "look"
        value = f"{portal}.{verb}({call.removesuffix('()') if call.endswith('()') else f'lambda: {call}'})"
        return text, [f"        {'' if text == 'None' else 'return '}{f'{wrap}({value})' if wrap else value}"]

    @staticmethod
    def kind_of(node: ast.FunctionDef | ast.AsyncFunctionDef, words: set[str]) -> tuple[str, ast.expr]:
        """How a method is to be used, and the type of what comes of it."""
        returns = node.returns
        assert returns
        name = ast.unparse(returns.value) if isinstance(returns, ast.Subscript) else ""
        if "asynccontextmanager" in words or name == "AbstractAsyncContextManager":
            assert isinstance(returns, ast.Subscript)
            inner = returns.slice
            return "block", inner.elts[0] if isinstance(inner, ast.Tuple) else inner

        if name in {"AsyncIterator", "AsyncGenerator"}:
            assert isinstance(returns, ast.Subscript)
            inner = returns.slice
            return "items", inner.elts[0] if isinstance(inner, ast.Tuple) else inner

        if name == "Coroutine":
            assert isinstance(returns, ast.Subscript)
            assert isinstance(returns.slice, ast.Tuple)
            return "wait", returns.slice.elts[2]

        return ("wait" if isinstance(node, ast.AsyncFunctionDef) else "look"), returns

    def type_of(self, node: ast.expr, source: Source) -> tuple[str, str]:
        """A type as it is written here, and what makes a twin of such a value, "" where it needs none."""
        if isinstance(node, ast.Name):
            kind = getattr(source.module, node.id, None)
            if isinstance(kind, type) and kind in self.homes:
                name = self.sync(*self.homes[kind])
                return name, name

        given = self.given_as(node, source)
        if given:
            name = self.sync(*given.called.split(":"))
            text = ast.unparse(node)
            return name + text[text.find(" ") :] * (" " in text), given.told and self.sync(*given.told.split(":"))

        if ast.unparse(node) == "list[Motion]":
            name = self.sync("motion", "Motion")
            return f"list[{name}]", self.sync("bases", "motions")

        return self.expression(node, source), ""

    def arguments(self, node: ast.arguments, source: Source) -> str:
        """The parameters, with their types and defaults."""
        (copy,) = ast.parse(f"def f({ast.unparse(node)}): ...").body
        assert isinstance(copy, ast.FunctionDef)
        found = copy.args
        everything = [*found.posonlyargs, *found.args, *found.kwonlyargs]
        everything += [each for each in (found.vararg, found.kwarg) if each]
        hidden = [each for each in found.kwonlyargs if each.arg in HIDDEN]
        for each in hidden:
            place = found.kwonlyargs.index(each)
            del found.kwonlyargs[place], found.kw_defaults[place]

        everything = [each for each in everything if each not in hidden]
        for each in everything:
            if each.annotation:
                each.annotation = ast.parse(self.type_of(each.annotation, source)[0], mode="eval").body

        found.defaults = [self.default(each, source) for each in found.defaults]
        found.kw_defaults = [each and self.default(each, source) for each in found.kw_defaults]
        return ast.unparse(found)

    def default(self, node: ast.expr, source: Source) -> ast.expr:
        """A default: numbers and words as they are, whatever they are called there."""
        if isinstance(node, ast.Name):
            value = getattr(source.module, node.id, node)
            if isinstance(value, int | float | str) and type(value) in {int, float, str}:
                return ast.Constant(value)

            if isinstance(value, tuple):
                return ast.parse(repr(value), mode="eval").body

        self.expression(node, source)
        return node

    def expression(self, node: ast.expr, source: Source) -> str:
        """An expression as it stands, after what it names was imported."""
        for each in ast.walk(node):
            if isinstance(each, ast.Name):
                self.name(each.id, source)
            elif isinstance(each, ast.Constant) and isinstance(each.value, str):
                continue

        return ast.unparse(node)

    def name(self, name: str, source: Source) -> None:
        """Import a name of a module of the driver, wherever that has it from."""
        value = getattr(source.module, name, None)
        if isinstance(value, TypeVar):
            self.variables[name] = value
        elif name in source.imported:
            self.need(*source.imported[name], name)
        elif not hasattr(builtins, name):
            assert hasattr(source.module, name), f"{name} in {source.module.__name__}"
            self.need(source.module.__name__, name)

    @staticmethod
    def docstring(text: str, indent: str = "    ") -> str:
        """A docstring, in the words of those who do not await."""
        for pattern, word in WORDS:
            text = re.sub(pattern, word, text)

        if not text:
            return ""

        lines = text.splitlines()
        end = '"""' if len(lines) == 1 else f'\n{indent}"""'
        return textwrap.indent(f'"""{text}', indent).replace("\n\n\n", "\n\n") + end


WORDS = (
    *((rf" +{name}: [^\n]*\n( {{8,}}[^\n]*\n)*", "") for name in HIDDEN),
    (r"await (?=(arm|robot)\.)", ""),
    (r"async with ", "with "),
    (r"async for ", "for "),
    (r"Wait as `await motion` does, for", "Wait until it has ended, for"),
    (r"to be awaited( |\.)", r"to be waited for\1"),
    (r"which may be awaited", "to be waited for"),
    (r"nobody awaits", "nobody waits for"),
    (r"call that awaits it", "call that waits for it"),
    (r"await it ", "wait for it "),
    (
        r" and return what runs it when it is awaited or iterated over",
        " and return what runs it: call its `wait`, or iterate",
    ),
    (
        r"return what runs it when it is awaited or iterated over",
        "return what runs it: call its `wait`, or iterate over it",
    ),
    (r"awaiting it returns at once", "`wait` returns at once"),
    (r"arm\.run_gcode\(\"part.gcode\"\)", 'arm.run_gcode("part.gcode").wait()'),
    (r": a function, async or not\.", ": a function."),
    (r"None until it is cancelled", "None until it is interrupted"),
    (r"; made by `MyCobot\.connect`", "; made by `connect`"),
)


def parted(text: str) -> tuple[str, dict[str, str]]:
    """A class's docstring without its attributes, and what it says of each of them."""
    about, _, rest = text.partition("\n\nAttributes:\n")
    attributes = re.findall(r"^ {4}(\w+): (.*(?:\n {8}.*)*)", rest, re.MULTILINE)
    return about, {name: " ".join(said.split()) for name, said in attributes}


def call_of(node: ast.arguments, taken: Mapping[str, str] = MappingProxyType({})) -> str:
    """The arguments of a call that hands all on; by name, what makes the one that is taken of the one that is given."""

    def value(name: str) -> str:
        return f"{taken[name]}({name})" if name in taken else name

    found = [value(each.arg) for each in (*node.posonlyargs, *node.args) if each.arg not in {"self", "cls"}]
    found += [f"*{node.vararg.arg}"] if node.vararg else []
    found += [f"{each.arg}={value(each.arg)}" for each in node.kwonlyargs if each.arg not in HIDDEN]
    found += [f"**{node.kwarg.arg}"] if node.kwarg else []
    return ", ".join(found)


def tidy(text: str, name: str) -> str:
    """The text as ruff has it."""
    path = ROOT / "dobot_async" / "sync" / f"{name}.py"
    for command in (["check", "--fix-only", "-q"], ["format", "-q"]):
        ruff = [sys.executable, "-m", "ruff", *command, "--stdin-filename", str(path), "-"]
        text = subprocess.run(ruff, input=text, capture_output=True, text=True, check=True, cwd=ROOT).stdout

    return text


def generated() -> dict[Path, str]:
    """All modules, tidy."""
    return {ROOT / "dobot_async" / "sync" / f"{name}.py": tidy(Writer(name).written(), name) for name in PAGES}


if __name__ == "__main__":
    for path, text in generated().items():
        path.write_text(text, encoding="utf-8")
