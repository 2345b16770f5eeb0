import numpy as np
import pytest
from scenes_found import SMALL, START, TWO_EYES, egg, one_step, pictures, started

from servoid._native import OneStepSettings, OneStepTracker, Pose
from servoid.errors import ImageError, ServoidError, TrackError


def test_an_estimate_has_the_shapes_that_it_promises() -> None:
    pose = Pose.from_parts([0.005, 0, 0.5], [1, 0, 0, 0])
    estimate = started().step(0.1, TWO_EYES, pictures(pose))
    assert estimate.time_s == 0.1
    assert estimate.status == "tracking"
    assert 0.8 < estimate.confidence <= 1
    assert estimate.covariance.shape == (6, 6)
    assert np.allclose(estimate.covariance, estimate.covariance.T)
    assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-12
    assert estimate.unobservable.shape[1] == 6
    assert estimate.notices == []
    assert estimate.evaluations == OneStepSettings().population
    assert list(estimate.seconds) == ["prepare", "search", "refine", "verify", "update"]
    assert estimate.seconds["search"] > 0


def test_a_place_alone_follows_a_moving_object_and_keeps_its_turn() -> None:
    assert one_step.broken(3) == []


def test_an_orientation_that_is_told_is_held() -> None:
    tracker = started(OneStepSettings(turns=False))
    tracker.set_orientation([0, 1, 0, 0])
    estimate = tracker.step(0.1, TWO_EYES, pictures(START))
    assert estimate.world_from_object.quaternion == (0, 1, 0, 0)


def test_masks_teach_as_outlines_do() -> None:
    tracker = OneStepTracker([SMALL, SMALL], egg())
    masks = [egg().silhouette(SMALL, TWO_EYES[0]), None]
    with_masks = tracker.start(0.0, TWO_EYES, pictures(START), START, masks)
    without = tracker.start(0.0, TWO_EYES, pictures(START), START)
    assert np.array_equal(with_masks.covariance, without.covariance)


def test_missing_and_wrong_images_are_notices() -> None:
    tracker = started()
    image, small = pictures(START)[0], np.zeros((3, 4), np.uint8)
    estimate = tracker.step(0.1, TWO_EYES, [image, None])
    assert estimate.status == "tracking"
    assert estimate.notices == ["camera 1 delivered no image"]
    estimate = tracker.step(0.2, TWO_EYES, [small, None])
    assert estimate.status == "searching"
    assert "the image is 4x3 pixels" in estimate.notices[0]


def test_what_cannot_be_tracked_is_said() -> None:
    with pytest.raises(TrackError, match="was not started"):
        OneStepTracker([SMALL, SMALL], egg()).step(0.0, TWO_EYES, pictures(START))
    with pytest.raises(ImageError, match="2 cameras needs as many images, but was given 1"):
        started().step(0.1, TWO_EYES, pictures(START)[:1])
    with pytest.raises(ServoidError, match="at least one camera"):
        OneStepTracker([], egg())
    with pytest.raises(TrackError, match="reach must be a positive number"):
        OneStepTracker([SMALL], egg(), OneStepSettings(reach=-1))
    with pytest.raises(TrackError, match="give one or the other"):
        OneStepSettings(region=True, points=10)


def test_settings_show_what_they_hold() -> None:
    given = OneStepSettings(seed=4, turns=False, points=50, alpha=0.2, population=30, elites=2)
    held = (given.seed, given.turns, given.points, given.alpha, given.population, given.elites)
    assert held == (4, False, 50, 0.2, 30, 2)
    assert not given.region
    assert OneStepSettings(region=True).region
    assert OneStepSettings(region=True).points is None
    wide = OneStepSettings(mutation_rate=0.4, mutation_width=0.2, least_width=0.1)
    assert (wide.mutation_rate, wide.mutation_width, wide.least_width) == (0.4, 0.2, 0.1)
    assert (OneStepSettings().reach, OneStepSettings().turn) == (given.reach, given.turn)
