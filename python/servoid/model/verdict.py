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
    """The rating of a body: `word` is good, rough or poor, None where no view shows the body."""

    word: str | None
    reason: str

    @property
    def words(self) -> str:
        """Return the word, if there is one, with the reason."""
        return self.reason if self.word is None else f"{self.word}: {self.reason}"


def rate_body(views: Sequence[tuple[str, float]], fitness: float) -> ModelVerdict:
    """Rate a body by its silhouette IoU in all views, which are given with their names."""
    if not views:
        reason = f"the body fits the input with F = {fitness:.3f}, where 1 is a perfect fit"
        return ModelVerdict(None, reason)
    name, worst = min(views, key=lambda view: view[1])
    mean = float(np.mean([iou for _, iou in views]))
    word = next(word for word, least in _WORDS if worst >= least)
    return ModelVerdict(
        word,
        f"the body explains {100.0 * worst:.1f} % of the worst view, {name}, and "
        f"{100.0 * mean:.1f} % on average",
    )
