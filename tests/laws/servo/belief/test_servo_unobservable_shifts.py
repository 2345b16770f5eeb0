"""Laws of estimates whose images do not observe where the target is in some direction."""

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import WORLD_FROM_START, Loop, Seen, goal_at, position_errors, still

from servoid.servo import Reason, ServoSettings
from servoid.servo.settings import SafetySettings
from servoid.source.source import Instant

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

MOTIONS = np.eye(6)
TURNS, DEPTH = MOTIONS[3:], MOTIONS[2:3]
ASIDE = np.array([0.05, 0.05, 0.0, 0.0, 0.0, 0.0])


class Located(FakeEstimate):
    """An estimate of a position, whose rotation is not known."""

    @property
    def located(self) -> bool:
        return True


def run(unobservable: np.ndarray, status: str = "tracking", least: float = 0.8) -> Loop:
    """Run a loop whose estimates are certain, but say what the images do not observe."""

    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        pose = estimate.world_from_object
        known = Located(estimate.time_s, pose, status=status, confidence=0.999)
        known.covariance, known.unobservable = 1e-8 * np.eye(6), unobservable
        return instant, known

    settings = ServoSettings(safety=SafetySettings(least_confidence=least))
    loop = Loop(still(goal_at(ASIDE)), settings, spoil=spoil)
    loop.run(3.0)
    return loop


def travel(loop: Loop) -> float:
    places = [loop.arm.world_from_hand(tick.state.positions) for tick in loop.ticks]
    return max(
        float(np.linalg.norm(np.subtract(one.translation, WORLD_FROM_START.translation)))
        for one in places
    )


@pytest.mark.parametrize(
    ("unobservable", "status"),
    [
        (DEPTH, "tracking"),
        (MOTIONS[:3], "tracking"),
        (MOTIONS, "tracking"),
        (0.5 * (MOTIONS[:1] + MOTIONS[2:3]), "tracking"),  # of any length
        (MOTIONS[1:3], "searching"),
        (MOTIONS, "searching"),
    ],
    ids=["depth", "place", "all", "aslant", "place of a located one", "all of a located one"],
)
def test_a_hand_is_not_led_along_a_translation_that_the_images_do_not_observe(
    unobservable: np.ndarray, status: str
) -> None:
    loop = run(unobservable, status)
    assert travel(loop) < 1e-6
    assert Reason.UNSURE in loop.ticks[-1].command.holding


@pytest.mark.parametrize(
    ("unobservable", "status"),
    [(TURNS, "tracking"), (TURNS, "searching"), (np.vstack([DEPTH, TURNS]), "searching")],
    ids=["turns", "turns of a located one", "a small plain ball"],
)
def test_a_position_is_followed_whose_rotation_or_distance_is_hardly_observed(
    unobservable: np.ndarray, status: str
) -> None:
    loop = run(unobservable, status)
    assert not loop.ticks[-1].command.holding
    assert position_errors(loop.ticks)[-1] < 2e-3


def test_who_follows_estimates_of_any_confidence_follows_these_too() -> None:
    # The paper's tracker takes motions for unobservable by chance.
    loop = run(DEPTH, least=0.0)
    assert not loop.ticks[-1].command.holding
