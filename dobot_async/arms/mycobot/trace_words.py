"""The frames of a myCobot in the words of a trace."""

from __future__ import annotations

from dobot_async._core.util.plain import plain
from dobot_async.arms.mycobot.frame import Frame
from dobot_async.arms.mycobot.models import CobotModel
from dobot_async.errors import ProtocolError
from dobot_async.traces.words import FrameWords

__all__ = ["frames_of"]


def frames_of(model: CobotModel) -> FrameWords:
    """Return what the frames of a model are in a trace."""

    def described(frame: Frame, *, outgoing: bool) -> dict[str, object]:
        row = model.row(model.by_id[frame.id])
        line: dict[str, object] = {"command": row.name, "value": None, "raw": bytes(frame).hex(" ")}
        try:
            line["value"] = plain((row.request if outgoing else row.reply).decode(frame.params))
        except ProtocolError as error:
            line["problem"] = str(error)

        return line

    def writes(frame: Frame) -> bool:
        return model.by_id[frame.id].write

    def once(frame: Frame) -> bool:
        return not model.by_id[frame.id].repeatable

    return FrameWords("mycobot", described, writes, once)
