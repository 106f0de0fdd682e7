"""What each notebook says when all is well; the site has to show it, too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

__all__ = ["NOTEBOOKS", "WORDS"]

NOTEBOOKS = Path(__file__).parents[2] / "docs" / "notebooks"
WORDS: Mapping[str, Sequence[str]] = {
    "first-steps": ("[True, True, True, True] 0", "0x11 PLAN_INV_CALC", "is too far"),
    "pick-and-place": (
        "part 1 is on the pallet at [120, 140, -118]",
        "part 3 is on the pallet",
        "there was no part to pick",
    ),
    "faults-and-awaits": (
        "moves commanded 7 and executed 7",
        "3 done",
        "4 ArmAlarm 0x11 PLAN_INV_CALC",
        "MotionStopped:",
        "given up; the arm has aborted ['SetWAITCmd']",
        "ReplyTimeout:",
        "MotionUnknown:",
        "heard; the arm has aborted ['SetWAITCmd']",
        "ConnectionLost:",
    ),
    "drawing-with-preview": ("9 strokes on the paper, 9 in the file",),
    "two-arms": ("{'left': 220, 'right': 220}", "ArmAlarm: right:", "MotionStopped ended the left arm's wait"),
    "data-logging": ("enough readings: True", "seconds,x_mm,y_mm,z_mm", "LinkStats("),
}
