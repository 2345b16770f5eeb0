"""Rates a body in a word, with the reason; page and terminal use this one rule."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# The minimum IoU of the worst view for each word.
_WORDS = (("good", 0.8), ("rough", 0.6), ("poor", -math.inf))
GOOD_IOU = _WORDS[0][1]
"""The IoU below which a view is named as one that the body does not explain."""


@dataclass(frozen=True)
class ModelVerdict:
    """The rating of a body: `word` is good, rough or poor, None where no view shows the body.

    `is_doubted` says that a body whose views are explained well is not good for its doubts.
    """

    word: str | None
    reason: str
    is_doubted: bool = False

    @property
    def words(self) -> str:
        """Return the word, if there is one, with the reason."""
        if self.word is None:
            return self.reason
        return f"{self.word}{', as it is in doubt' if self.is_doubted else ''}: {self.reason}"


def rate_body(
    views: Sequence[tuple[str, float]], fitness: float, doubts: Sequence[str] = ()
) -> ModelVerdict:
    """Rate a body by its silhouette IoU in all views, which are given with their names.

    Views fit a body of wrong poses or masks as well, so one with `doubts` is rough at best.
    """
    if not views:
        reason = (
            f"not rated, as only images in which the object is marked can rate a body; it fits the "
            f"input with F = {fitness:.3f}, where 1 is a perfect fit"
        )
        return ModelVerdict(None, reason)
    name, worst = min(views, key=lambda view: view[1])
    mean = float(np.mean([iou for _, iou in views]))
    allowed = _WORDS[1:] if doubts else _WORDS
    word = next(word for word, least in allowed if worst >= least)
    return ModelVerdict(
        word,
        f"the body explains {100.0 * worst:.1f} % of the worst view, {name}, and "
        f"{100.0 * mean:.1f} % on average",
        is_doubted=bool(doubts) and worst >= GOOD_IOU,
    )
