"""Motions as spans of OpenTelemetry: each from the moment in which it is put until it has ended.

    with motion_spans(arm, name="left"):
        await arm.move_to(220, 0, 40)      # a span "SetPTPCmd", under the span that is current here

What the arm executed is a span that is OK; what failed, was stopped or is not known is an error, with the exception. It
needs the extra `otel`, and says nothing unless the program has an OpenTelemetry SDK.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from dobot_async._core.queue.motion import Motion

if TYPE_CHECKING:
    from opentelemetry.trace import Span, TracerProvider

    from dobot_async.arms.magician.arm import Magician
    from dobot_async.arms.mycobot.arm import MyCobot
    from dobot_async.arms.ultraarm.arm import UltraArm

__all__ = ["motion_spans"]

MISSING = "opentelemetry-api is not installed, and spans need it: pip install 'dobot-async[otel]'"


@contextmanager
def motion_spans(
    arm: Magician | MyCobot | UltraArm, *, name: str = "", provider: TracerProvider | None = None
) -> Generator[None]:
    """Make a span of each motion that is put while the block lasts.

    Those that have not ended at the end of the block are ended there, without a status.

    Args:
        arm: A connected arm.
        name: What the arm is called, for the attribute `dobot.arm`.
        provider: Where the spans go; by default to the program's.

    Raises:
        ImportError: The extra `otel` is not installed.
    """
    try:
        from opentelemetry import trace
    except ImportError as error:
        raise ImportError(MISSING, name=error.name) from error

    tracer = trace.get_tracer("dobot_async", tracer_provider=provider)
    spans: dict[Motion, Span] = {}

    def note(motion: Motion) -> None:
        if motion not in spans:
            attributes: dict[str, Any] = {"dobot.moves": motion.moves} | ({"dobot.arm": name} if name else {})
            spans[motion] = tracer.start_span(motion.name, attributes=attributes)

        if motion.index is not None:
            spans[motion].set_attribute("dobot.index", motion.index)

        if motion.ended:
            span, error = spans.pop(motion), motion.exception()
            if error:
                span.record_exception(error)
                span.set_status(trace.StatusCode.ERROR, type(error).__name__)
            else:
                span.set_status(trace.StatusCode.OK)

            span.end()

    arm.queue.on_motion.add(note)
    try:
        yield
    finally:
        arm.queue.on_motion.remove(note)
        for span in spans.values():
            span.end()
