"""The part of an SVG file that is drawn: groups and shapes, with every `use`, `svg` and `symbol` made a group.

    file --expat--> nodes with their lines --checks--> hidden ones left out, viewports as transforms --> plain SVG

What is done here svgelements does not do, or does without telling: it stops in silence at a mistake in path data, knows
no line of anything, and draws what is in masks, symbols and markers. It does styles, transforms and shapes.
"""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from dobot_async.toolpath.svg_checks import SHAPES, Node, SVGProblem, check, length, numbers_of

__all__ = ["parse_tree", "plain"]

logger: logging.Logger = logging.getLogger("dobot_async.toolpath")
SVG = "http://www.w3.org/2000/svg"
NOT_DRAWN = {"text": "convert it to paths", "image": "read it as a picture", "foreignObject": "convert it to paths"}
GROUPS = frozenset({"svg", "g", "a", "switch", "use", "symbol"})
DEEPEST = 200  # of elements inside of one another, every `use` among them
MOST = 200_000  # elements once every `use` is written out
ALONG_X = frozenset({"x", "x1", "x2", "cx", "width", "rx"})
ALONG_Y = frozenset({"y", "y1", "y2", "cy", "height", "ry"})


def parse_tree(data: bytes) -> Node:
    """Return the root of an SVG file; raise Misfit where it is broken."""
    parser = expat.ParserCreate(namespace_separator="}")
    stack: list[Node] = [Node("", {}, 0)]

    def start(name: str, attributes: Mapping[str, str]) -> None:
        space, _, tag = name.rpartition("}")
        if len(stack) > DEEPEST:
            raise SVGProblem(parser.CurrentLineNumber, f"more than {DEEPEST} elements inside of one another")

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
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise SVGProblem(error.lineno, f"this is no XML: {reason} (column {error.offset + 1})") from None

    except (LookupError, ValueError) as error:
        raise SVGProblem(1, f"its encoding is not known: {error}") from None

    root = stack[0].children[0]
    if root.tag != "svg":
        raise SVGProblem(root.line, f"this is no SVG: its root is <{root.tag.removeprefix('other-')}>")

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


class SVGWriter:
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
        self.height: float = self._page.height

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
            raise SVGProblem(node.line, "more elements than a drawing has, once every <use> is written out")

        check(node)
        if node.tag in SHAPES:
            shape = {name: self._length(node, name, value, view) for name, value in node.attributes.items()}
            self._parts.append(
                f"<{node.tag} {attributes(shape | {'data-line': str(node.line), 'data-layer': layer})}/>"
            )
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
            raise SVGProblem(
                node.line, f"<use> of {node.attributes.get('href', 'nothing')!r}, which is not in the file"
            )

        if name in using:
            raise SVGProblem(node.line, f"<use> of {name!r}, which uses itself")

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
                raise SVGProblem(node.line, "viewBox: width and height must be above 0")

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
    writer = SVGWriter(root)
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
