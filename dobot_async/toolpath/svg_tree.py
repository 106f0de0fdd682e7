"""The part of an SVG file that is drawn: groups and shapes, with every `use`, `svg` and `symbol` made a group.

    file --expat--> nodes with their lines --checks--> hidden ones left out, viewports as transforms --> plain SVG

What is done here svgelements does not do, or does without telling: it stops in silence at a mistake in path data, knows
no line of anything, and draws what is in masks, symbols and markers. It does styles, transforms and shapes.
"""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

__all__ = ["Misfit", "Node", "parse_tree", "plain"]

logger = logging.getLogger("dobot_async.toolpath")
SVG = "http://www.w3.org/2000/svg"
SHAPES = frozenset({"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"})
GROUPS = frozenset({"svg", "g", "a", "switch", "use", "symbol"})
NEVER_DRAWN = frozenset({"defs", "symbol", "clipPath", "mask", "marker", "pattern", "linearGradient", "radialGradient"})
UNTOLD = frozenset({"title", "desc", "metadata", "filter", "style", "script", *NEVER_DRAWN})
NOT_DRAWN = {"text": "convert it to paths", "image": "trace it, or read it as a picture", "foreignObject": "leave it out"}
DEEPEST = 200  # of elements inside of one another, every `use` among them
MOST = 200_000  # elements once every `use` is written out
PX = {"": 1.0, "px": 1.0, "in": 96.0, "mm": 96 / 25.4, "cm": 960 / 25.4, "pt": 96 / 72, "pc": 16.0, "q": 96 / 101.6}
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LENGTH = re.compile(rf"\s*({NUMBER})\s*(%|[a-zA-Z]*)\s*")
NUMBERS = re.compile(rf"[\s,]*(?:{NUMBER}[\s,]*)*")
TRANSFORM = re.compile(
    rf"\s*(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*\(\s*(?:{NUMBER}(?:[a-z%]*)[\s,]*)+\)[\s,]*)*"
)
DATA = re.compile(rf"\s*([MmZzLlHhVvCcSsQqTtAa])|[\s,]*({NUMBER})|(\s+)$")
FLAG = re.compile(r"[\s,]*([01])")
ARGUMENTS = {"m": 2, "z": 0, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7}
ALONG_X = frozenset({"x", "x1", "x2", "cx", "width", "rx"})
ALONG_Y = frozenset({"y", "y1", "y2", "cy", "height", "ry"})


class Misfit(Exception):
    """What is wrong, and in which line."""

    def __init__(self, line: int, reason: str) -> None:
        super().__init__(reason)
        self.line = line
        self.reason = reason


@dataclass(slots=True)
class Node:
    """One element: its name without the namespace, its attributes, what is in it, and its line."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def walk(self) -> Iterator[Node]:
        """Yield this and all that is in it."""
        yield self
        for child in self.children:
            yield from child.walk()


def parse_tree(data: bytes) -> Node:
    """Return the root of an SVG file; raise Misfit where it is broken."""
    parser = expat.ParserCreate(namespace_separator="}")
    stack: list[Node] = [Node("", {}, 0)]

    def start(name: str, attributes: Mapping[str, str]) -> None:
        space, _, tag = name.rpartition("}")
        if len(stack) > DEEPEST:
            raise Misfit(parser.CurrentLineNumber, f"more than {DEEPEST} elements inside of one another")

        found = {key.rpartition("}")[2]: value for key, value in attributes.items() if key.rpartition("}")[2] == key}
        found |= {key.rpartition("}")[2]: value for key, value in attributes.items() if "}" in key}
        node = Node(tag if space in {"", SVG} else f"other-{tag}", found, parser.CurrentLineNumber)
        stack[-1].children.append(node)
        stack.append(node)

    def text(data: str) -> None:
        stack[-1].text += data

    def end(_: str) -> None:
        stack.pop()

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    try:
        parser.Parse(data, True)  # noqa: FBT003 - expat's own
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise Misfit(error.lineno, f"this is no XML: {reason} (column {error.offset + 1})") from None

    root = stack[0].children[0]
    if root.tag != "svg":
        raise Misfit(root.line, f"this is no SVG: its root is <{root.tag.removeprefix('other-')}>")

    return root


@dataclass(frozen=True, slots=True)
class Viewport:
    """How large what percentages are of is, in user units."""

    width: float
    height: float

    def of(self, name: str) -> float:
        """What 100 % of an attribute are."""
        if name in ALONG_X:
            return self.width

        return self.height if name in ALONG_Y else math.hypot(self.width, self.height) / math.sqrt(2)


class Writer:
    """Writes what is drawn of a tree as SVG of groups and shapes in px, y down.

    Attributes:
        height: Of the page, px.
    """

    def __init__(self, root: Node) -> None:
        self._root = root
        self._named = {node.attributes["id"]: node for node in root.walk() if "id" in node.attributes}
        self._parts: list[str] = []
        self._count = 0
        box = numbers_of(root, "viewBox", 4) if "viewBox" in root.attributes else None
        of_box = Viewport(box[2], box[3]) if box else Viewport(100.0, 100.0)
        self._page = Viewport(
            *(side(root, name, default) for name, default in (("width", of_box.width), ("height", of_box.height)))
        )
        self.height = self._page.height

    def write(self) -> str:
        """Return the text."""
        styles = "".join(node.text for node in self._root.walk() if node.tag == "style")
        self._parts = [f'<svg xmlns="{SVG}"><style>{escape(styles)}</style>']
        self._viewport(self._root, self._page, Viewport(1, 1), (), "")
        self._parts.append("</svg>")
        return "".join(self._parts)

    def _element(self, node: Node, view: Viewport, using: tuple[str, ...], layer: str) -> None:
        """Write one element, if it is drawn."""
        if node.tag in NOT_DRAWN and not hidden(node):
            logger.warning("line %d: <%s> is not drawn: %s", node.line, node.tag, NOT_DRAWN[node.tag])

        if hidden(node) or node.tag not in SHAPES | GROUPS or node.tag == "symbol":
            return

        self._count += 1
        if self._count > MOST or len(using) > DEEPEST:
            raise Misfit(node.line, "more elements than a drawing has, once every <use> is written out")

        check(node)
        if node.tag in SHAPES:
            shape = {name: self._length(node, name, value, view) for name, value in node.attributes.items()}
            self._parts.append(f"<{node.tag} {attributes(shape | {'data-line': str(node.line), 'data-layer': layer})}/>")
        elif node.tag == "use":
            self._use(node, view, using, layer)
        elif node.tag == "svg":
            at = [self._measure(node, name, view) for name in ("x", "y")]
            size = Viewport(*(self._measure(node, name, view, "100%") for name in ("width", "height")))
            self._open(node, translate=(at[0], at[1]))
            self._viewport(node, size, view, using, layer)
            self._parts.append("</g>")
        else:
            self._group(node, view, using, layer)

    def _group(self, node: Node, view: Viewport, using: tuple[str, ...], layer: str) -> None:
        self._open(node)
        name = node.attributes.get("label") or node.attributes.get("id") or ""
        for child in drawn_children(node):
            self._element(child, view, using, layer or (name if node.tag == "g" else ""))

        self._parts.append("</g>")

    def _use(self, node: Node, view: Viewport, using: tuple[str, ...], layer: str) -> None:
        """What it refers to, as a group of its own."""
        name = node.attributes.get("href", "").removeprefix("#")
        target = self._named.get(name)
        if target is None:
            raise Misfit(node.line, f"<use> of {node.attributes.get('href', 'nothing')!r}, which is not in the file")

        if name in using:
            raise Misfit(node.line, f"<use> of {name!r}, which uses itself")

        self._open(node, translate=(self._measure(node, "x", view), self._measure(node, "y", view)))
        if target.tag in {"symbol", "svg"}:
            if not hidden(target):
                size = Viewport(*(self._measure(node, side, view, "100%") for side in ("width", "height")))
                self._open(target)
                self._viewport(target, size, view, (*using, name), layer)
                self._parts.append("</g>")
        else:
            self._element(target, view, (*using, name), layer)

        self._parts.append("</g>")

    def _viewport(self, node: Node, size: Viewport, _: Viewport, using: tuple[str, ...], layer: str) -> None:
        """What is in an <svg> or a <symbol>, in the coordinates of its viewBox."""
        inner = size
        transform = ""
        if "viewBox" in node.attributes:
            left, top, width, height = numbers_of(node, "viewBox", 4)
            if width <= 0 or height <= 0:
                raise Misfit(node.line, "viewBox: width and height must be above 0")

            inner = Viewport(width, height)
            transform = fitted(node.attributes.get("preserveAspectRatio", ""), size, (left, top), inner)

        self._parts.append(f"<g transform={quoteattr(transform)}>" if transform else "<g>")
        name = node.attributes.get("id", "") if layer else ""
        for child in node.children:
            self._element(child, inner, using, layer or name)

        self._parts.append("</g>")

    def _open(self, node: Node, translate: tuple[float, float] | None = None) -> None:
        """Open a group with the attributes that what is in it inherits."""
        leave_out = {"x", "y", "width", "height", "viewBox", "preserveAspectRatio", "href", "id", "label"}
        found = {name: value for name, value in node.attributes.items() if name not in leave_out}
        if translate and translate != (0.0, 0.0):
            found["transform"] = f"{found.get('transform', '')} translate({translate[0]!r} {translate[1]!r})"

        self._parts.append(f"<g {attributes(found)}>")

    def _measure(self, node: Node, name: str, view: Viewport, default: str = "0") -> float:
        return length(node, name, node.attributes.get(name, default), view.of(name))

    def _length(self, node: Node, name: str, value: str, view: Viewport) -> str:
        """An attribute of a shape, with percentages as user units."""
        if name in ALONG_X | ALONG_Y | {"r"} and value.strip() not in {"", "auto"}:
            return repr(length(node, name, value, view.of(name)))

        return value


def plain(root: Node) -> tuple[str, float]:
    """Return what is drawn as plain SVG in px, and the height of the page in px; raise Misfit where it is broken."""
    writer = Writer(root)
    return writer.write(), writer.height


def hidden(node: Node) -> bool:
    """Whether it, and all that is in it, is not to be seen."""
    style = dict(part.split(":", 1) for part in node.attributes.get("style", "").split(";") if ":" in part)
    style = {name.strip(): value.strip().removesuffix("!important").strip() for name, value in style.items()}
    display, opacity = (style.get(name, node.attributes.get(name, "")).strip() for name in ("display", "opacity"))
    return display == "none" or (bool(opacity) and bool(re.fullmatch(r"0*\.?0*%?", opacity)))


def drawn_children(node: Node) -> list[Node]:
    """What is in a group; of a <switch> the first that needs no extension."""
    if node.tag != "switch":
        return node.children

    fits = (child for child in node.children if not child.attributes.get("requiredExtensions"))
    return [child for child in fits if child.tag in SHAPES | GROUPS][:1]


def attributes(found: Mapping[str, str]) -> str:
    """Attributes as they are written; names of other namespaces have lost theirs, and names with colons are no loss."""
    return " ".join(f"{name}={quoteattr(value)}" for name, value in found.items() if re.fullmatch(r"[\w.-]+", name))


def side(root: Node, name: str, default: float) -> float:
    """A side of the page in px; percentages, and none, leave it to the viewBox."""
    value = root.attributes.get(name, "100%")
    return length(root, name, value, default) if value.strip() != "auto" else default


def length(node: Node, name: str, value: str, whole: float) -> float:
    """A length in user units; raise Misfit for what is none."""
    match = LENGTH.fullmatch(value)
    unit = match[2].lower() if match else ""
    if match and unit == "%":
        return float(match[1]) / 100 * whole

    if match is None or unit not in PX or not math.isfinite(float(match[1])):
        raise Misfit(node.line, f"<{node.tag}>: {name}={value!r} is no length (of {', '.join(filter(None, PX))} or %)")

    return float(match[1]) * PX[unit]


def numbers_of(node: Node, name: str, count: int) -> list[float]:
    """So many numbers in an attribute; raise Misfit for others."""
    value = node.attributes[name]
    found = [float(number) for number in re.findall(NUMBER, value)]
    if not NUMBERS.fullmatch(value) or len(found) != count or not all(map(math.isfinite, found)):
        raise Misfit(node.line, f"<{node.tag}>: {name}={value!r} must be {count} numbers")

    return found


def fitted(aspect: str, size: Viewport, corner: tuple[float, float], box: Viewport) -> str:
    """The transform that brings a viewBox into a viewport; SVG 1.1, 7.8."""
    across, down = size.width / box.width, size.height / box.height
    words = aspect.replace("defer", "").split() or ["xMidYMid"]
    x = y = 0.0
    if words[0] != "none":
        across = down = (max if "slice" in words else min)(across, down)
        shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
        x = shares.get(words[0][1:4], 0.5) * (size.width - box.width * across)
        y = shares.get(words[0][5:8], 0.5) * (size.height - box.height * down)

    return f"translate({x!r} {y!r}) scale({across!r} {down!r}) translate({-corner[0]!r} {-corner[1]!r})"


def check(node: Node) -> None:
    """Raise Misfit for attributes that svgelements would read half of, and say nothing."""
    for name, checks in CHECKS.items():
        if name in node.attributes and (name in {"transform"} or node.tag in SHAPES):
            checks(node, node.attributes[name])


def check_transform(node: Node, value: str) -> None:
    """Known functions with numbers."""
    if not TRANSFORM.fullmatch(value):
        raise Misfit(node.line, f"<{node.tag}>: transform={value!r} is not understood")


def check_points(node: Node, value: str) -> None:
    """Pairs of numbers."""
    count = len(re.findall(NUMBER, value))
    if not NUMBERS.fullmatch(value) or count % 2:
        raise Misfit(node.line, f"<{node.tag}>: points must be pairs of numbers, not {shortened(value)}")


def check_data(node: Node, value: str) -> None:
    """Path data: letters, each with a whole number of its arguments."""
    place, letter, count = 0, "", 0

    def wrong(reason: str) -> Misfit:
        return Misfit(node.line, f"<path>: {reason} at character {place + 1} of its data, {shortened(value[place:])}")

    while place < len(value):
        match = (FLAG if letter in "Aa" and letter and count % 7 in {3, 4} else DATA).match(value, place)
        if match is None:
            if not value[place:].strip():
                break
            raise wrong("something that is no path data")

        word = match[1] if match.re is DATA else None
        if word and count % max(1, ARGUMENTS.get(letter.lower(), 1)):
            raise wrong(f"{letter} has too few numbers")

        if word and letter and letter in "MmLlHhVvCcSsQqTtAa" and not count:
            raise wrong(f"{letter} has no numbers")

        if word:
            if not letter and word not in "Mm":
                raise wrong("data that does not begin with M")
            letter, count = word, 0
        elif match.re is FLAG or match[2]:
            if not ARGUMENTS.get(letter.lower(), 0):
                raise wrong(f"a number where {letter or 'M'} takes none" if letter else "data that does not begin with M")
            count += 1

        place = match.end()

    if letter and (count % max(1, ARGUMENTS[letter.lower()]) or (ARGUMENTS[letter.lower()] and not count)):
        raise wrong(f"{letter} has too few numbers")


def shortened(text: str) -> str:
    """What is told of a long text."""
    return repr(text if len(text) <= 30 else f"{text[:27]}...")


CHECKS: Mapping[str, Callable[[Node, str], None]] = {
    "transform": check_transform,
    "points": check_points,
    "d": check_data,
}
