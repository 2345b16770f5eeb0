"""Rates a body in a word, with the reason; page and terminal use this one rule."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# The minimum IoU of the worst view for each word.
_WORDS = (("good", 0.8), ("rough", 0.6), ("poor", -math.inf))
GOOD_IOU = _WORDS[0][1]
"""The IoU below which a view is named as one that the body does not explain."""
LEAST_IOU = _WORDS[1][1]
"""The IoU below which a body is poor."""


@dataclass(frozen=True)
class ModelVerdict:
    """The rating of a body: `word` is good, rough or poor.

    `is_doubted` says that a body whose input is explained well is not good for its doubts.
    """

    word: str
    reason: str
    is_doubted: bool = False

    @property
    def words(self) -> str:
        """Return the word with the reason."""
        return f"{self.word}{', as it is in doubt' if self.is_doubted else ''}: {self.reason}"


def rate_body(
    views: Sequence[tuple[str, float]], fitness: float, doubts: Sequence[str] = ()
) -> ModelVerdict:
    """Rate a body by its silhouette IoU in all views, which are given with their names.

    One of a mesh or a cloud, without views, is rated by its fitness, which is an IoU as well. Views
    fit a body of wrong poses or masks as well, so one with `doubts` is rough at best.
    """
    if views:
        name, worst = min(views, key=lambda view: view[1])
        mean = float(np.mean([iou for _, iou in views]))
        reason = (
            f"the body explains {100.0 * worst:.1f} % of the worst view, {name}, and "
            f"{100.0 * mean:.1f} % on average"
        )
    else:
        worst = fitness
        reason = f"the body fits the input with F = {fitness:.3f}, where 1 is a perfect fit"
    allowed = _WORDS[1:] if doubts else _WORDS
    word = next(word for word, least in allowed if worst >= least)
    return ModelVerdict(word, reason, is_doubted=bool(doubts) and worst >= GOOD_IOU)
