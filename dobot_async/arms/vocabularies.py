"""What programs are written in, for the arms of each family."""

from __future__ import annotations

from dobot_async.arms.registry import Parts
from dobot_async.program.vocabulary import Vocabulary

__all__ = ["VOCABULARIES"]

VOCABULARIES: Parts[Vocabulary] = Parts("program")
"""By the words of the families and their models."""
