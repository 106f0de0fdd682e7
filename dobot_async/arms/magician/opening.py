"""The way to a Magician: what its link asks to find out what was lost, and why no arm may answer."""

from __future__ import annotations

from dobot_async._core.link.link import Link
from dobot_async.arms.magician import commands as c
from dobot_async.arms.magician.frame import Frame
from dobot_async.errors import ConnectFailed

__all__ = ["BARRIERS", "silent"]

BARRIERS = (
    c.GET_END_EFFECTOR_PARAMS,
    c.GET_PTP_COMMON_PARAMS,
    c.GET_JOG_COMMON_PARAMS,
    c.GET_CP_PARAMS,
    c.GET_PTP_JUMP_PARAMS,
    c.GET_ARC_PARAMS,
    c.GET_HHT_TRIG_MODE,
    c.GET_END_EFFECTOR_LASER,
    c.GET_END_EFFECTOR_SUCTION_CUP,
    c.GET_END_EFFECTOR_GRIPPER,
    c.GET_HOME_PARAMS,
    c.GET_PTP_COORDINATE_PARAMS,
)
"""Cheap reads used as barriers: the answer to one proves that earlier requests will not be answered."""


def silent(link: Link[Frame]) -> ConnectFailed:
    """Why no arm answered, as far as what came instead tells."""
    if link.stats.junk_bytes:
        return ConnectFailed(
            f"{link.url} sends {link.stats.junk_bytes} bytes that are no answer of a Magician; is the baud rate right, "
            "is it a Magician, and does it run the Dobot firmware (in 3D-printing mode it speaks G-code)?"
        )

    return ConnectFailed(
        f"no Magician answers at {link.url}; is the arm switched on (not only on USB power), is this its port or "
        "address, and does it run the Dobot firmware (in 3D-printing mode it speaks G-code)?"
    )
