"""Trials with one changed number that the paper does not state, for its Figs. 8 and 9."""

from msgspec.structs import replace

from servoid_experiments.paper.maps.case import MapTrial
from servoid_experiments.paper.two.case import TwoTrial

AS_IT_IS = "as assumed"


def map_variants(trial: MapTrial) -> list[tuple[str, MapTrial]]:
    """Return the trial with one number changed at a time, and what was changed."""
    pair = trial.pair
    width, height = pair.size_px
    fine = replace(pair, size_px=(2 * width, 2 * height))
    coarse = replace(pair, size_px=(width // 2, height // 2))
    variants = [
        ("α a third", replace(trial, alpha=trial.alpha / 3.0)),
        ("α three times", replace(trial, alpha=3.0 * trial.alpha)),
        ("a fifth of the points", replace(trial, points=max(1, trial.points // 5))),
        ("images half as wide", replace(trial, pair=coarse)),
        ("images twice as wide", replace(trial, pair=fine)),
        ("four times the noise", replace(trial, pair=replace(pair, noise=4.0 * pair.noise))),
        ("a plain background", replace(trial, pair=replace(pair, background="plain"))),
    ]
    return [(words, changed) for words, changed in variants if changed != trial]


def two_variants(trial: TwoTrial) -> list[tuple[str, TwoTrial]]:
    """Return the trial with one number of the paper's procedure changed at a time."""
    variants = [
        ("α a third", replace(trial, alpha=trial.alpha / 3.0)),
        ("α three times", replace(trial, alpha=3.0 * trial.alpha)),
        ("a third of the generations", replace(trial, generations=max(1, trial.generations // 3))),
    ]
    return [(words, changed) for words, changed in variants if changed != trial]
