"""Programs: text that is read, converted and checked as a whole for one arm before anything is sent to it.

    text --lines--> Vocabulary.reader(options) --Reader.read--> Step(number, text, verb, command, value), ...
                                                          `--> ProgramError, which names every wrong line

`run`, `gcode`, `cell run` and `run --download` have their steps from here. What a verb means for an arm is in the
vocabulary of its family, `vocabulary.py` beside its verbs; no arm is known here.
"""

from __future__ import annotations

from dobot_async.arms.registry import Parts
from dobot_async.program.step import ProgramError, Step
from dobot_async.program.vocabulary import Vocabulary

__all__ = ["VOCABULARIES", "ProgramError", "Step", "Vocabulary"]

VOCABULARIES: Parts[Vocabulary] = Parts("program")
"""What programs are written in, by the words of the families and their models."""
