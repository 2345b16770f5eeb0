"""A bottle turns once around and back before two cameras, over bare sides and printed ones."""

from pathlib import Path

import pytest
from recordings_with_truth import recording_with_truth
from tracks_through import tracks_through
from trust_variants import VARIANTS
from trust_verdicts import Verdicts, verdicts

from servoid.track import Request, Subject


@pytest.mark.extended
@pytest.mark.parametrize("seed", [1, 3])
def test_a_turn_that_lags_on_a_bare_side_is_found_before_it_is_wrong(
    seed: int, tmp_path: Path
) -> None:
    # Edges of cap and neck stand still while a bottle turns. On the way back they held the turn
    # back by 30 degrees: 9 and 24 images were wrong and trusted, and 60 and 64 % tracked rightly.
    found = _turned("as it is", seed, tmp_path)
    assert not found.trusted_wrong.any()
    assert found.right.mean() > 0.74  # 79 and 79 %


@pytest.mark.extended
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_lets_a_turn_be_sought_and_never_wrong(seed: int, tmp_path: Path) -> None:
    # Few printed points were recognised, and told too little drift: 18 images were trusted wrongly
    # with seed 0. Residuals that weighed points in noise let the turn slip: 23 were, with seed 1.
    # One was with seed 0: a known side that came back made the drift small five images before an
    # adjustment by that side corrected the rotation by 10 degrees.
    found = _turned("noise", seed, tmp_path)
    assert not found.trusted_wrong.any()
    assert found.right.mean() > 0.5  # 67 and 62 %


@pytest.mark.extended
def test_the_end_of_a_loop_that_is_seen_twice_tells_little_of_its_middle(tmp_path: Path) -> None:
    # A known side came back, 48 degrees off, and was seen again in the next image, by which the
    # drift of all that was learned on the way counted as known. It was 12 to 20 degrees off: on the
    # next way over it, 4 images in a row were trusted wrongly.
    found = _turned("noise", 8, tmp_path)
    assert not found.trusted_wrong.any()
    assert found.right.mean() > 0.5  # 62 %


@pytest.mark.extended
@pytest.mark.parametrize("seed", [14, 19])
def test_a_turn_that_a_bare_side_held_back_is_doubted_until_a_known_side_returns(
    seed: int, tmp_path: Path
) -> None:
    # Shading between two labels held the turn back by 15 and 20 degrees, and neither the drift nor
    # the adjustment of keyframes knew: 9 and 86 images were trusted wrongly, 5 and 73 in a row.
    found = _turned("JPEG", seed, tmp_path)
    assert not found.trusted_wrong.any()
    assert found.right.mean() > 0.5  # 61 and 62 %


@pytest.mark.extended
@pytest.mark.parametrize(("variant", "seed"), [("half size", 8), ("noise", 9)])
def test_a_known_side_that_comes_back_is_recognised_whatever_was_learned_on_the_way(
    variant: str, seed: int, tmp_path: Path
) -> None:
    # Points that were learned on the way lay on the label as well, at the drifted pose, and
    # outvoted its own: in half size the label was never recognised again, and 15 % of the images
    # tracked rightly; with noise it was once it faced the cameras, in image 108 of the turn's 120.
    found = _turned(variant, seed, tmp_path)
    assert not found.trusted_wrong.any()
    sought = [at for at in range(50, 120) if not found.tracking[at]]
    assert max(sought, default=0) < 100  # 90 and 92
    assert found.right.mean() > 0.5  # 59 and 61 %


def _turned(variant: str, seed: int, folder: Path) -> Verdicts:
    recording = recording_with_truth("hard/bleach_turn")
    capture = VARIANTS[variant].change(recording.capture, seed, folder)
    tracked = tracks_through(capture, [Subject()], Request(seed=seed))[0].tracked
    return verdicts(tracked, recording.truth, recording.vertices)
