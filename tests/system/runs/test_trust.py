"""Nothing wrong is trusted twice in a row, however objects turn, hide, leap and leave."""

from collections.abc import Sequence
from functools import cache
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np
import pytest
import trust_scenes
from drawn import Drawn, digest
from scene_table import table
from scenes_trust import (
    KNOWN,
    LOOKED_AT,
    TRUSTED,
    followed,
    off_figures,
    plain_sway,
    true_poses,
    trust_figures,
    trusts_twice,
)
from scipy.stats import chi2
from tiers import tiered
from tracks_through import tracks_through
from trust_scenes import COURSES, FULL, LEAVING_COURSES, MESHES, SMALL, write_course
from trust_variants import VARIANTS
from trust_verdicts import Verdicts, stretches, verdicts

from servoid.capture import open_capture
from servoid.pose import Pose
from servoid.track import Request

POINTS = 0.05 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
QUICK = [
    (name, KNOWN, seed)
    for name, seed in (("turn", 3), ("half hidden", 1), ("jump", 1), ("plain", 1))
]
LATE = [
    (name, how, seed)
    for name, (how, seeds) in product(COURSES, ((KNOWN, range(2)), (LOOKED_AT, range(1))))
    for seed in seeds
]
SPINS = [
    (how, size_px, seed)
    for seed in (1, 2, 0)
    for size_px in (FULL, SMALL)
    for how in (KNOWN, LOOKED_AT)
]


class Draw(Protocol):
    def __call__(self, name: str, seed: int, size_px: tuple[int, int] = SMALL) -> Path: ...


class Track(Protocol):
    def __call__(
        self, name: str, how: str, seed: int, size_px: tuple[int, int] = SMALL
    ) -> Verdicts: ...


@pytest.fixture(scope="module")
def course(drawn: Drawn, tmp_path_factory: pytest.TempPathFactory) -> Draw:
    """Draw a course once for all tests."""
    folder = tmp_path_factory.mktemp("courses")
    source = digest([Path(trust_scenes.__file__)])

    def draw(name: str, seed: int, size_px: tuple[int, int] = SMALL) -> Path:
        path = folder / f"{name} {seed} {size_px[0]}"
        if not path.exists():
            key = (name, seed, source) if size_px == SMALL else (name, seed, size_px, source)
            drawn(path, "course", key, lambda new: write_course(new, name, seed, size_px))
        return path

    return draw


@pytest.fixture(scope="module")
def tracked(course: Draw) -> Track:
    """Track a course once, for all laws of its track."""

    @cache
    def track(name: str, how: str, seed: int, size_px: tuple[int, int] = SMALL) -> Verdicts:
        return followed(name, how, seed, course(name, seed, size_px))

    return track


@pytest.mark.parametrize(
    ("name", "how", "seed"),
    tiered([*QUICK, *(one for one in LATE if one not in QUICK)], len(QUICK)),
)
def test_nothing_wrong_is_trusted_twice_in_a_row(
    name: str, how: str, seed: int, tracked: Track
) -> None:
    one = TRUSTED[name, how]
    found = tracked(name, how, seed)
    figures = trust_figures(found)
    failing = seed in table()[one.name, "wrong in a row"].failing
    if failing and trusts_twice(figures):
        # What failed when it was measured may fail.
        places = found.index[found.trusted_wrong].tolist()
        pytest.xfail(f"{one.name}, seed {seed}: wrong and trusted in images {places}")
    assert found.longest_wrong <= 1
    assert one.beyond(figures) == []


@pytest.mark.extended
@pytest.mark.parametrize(
    ("how", "seed"),
    [(LOOKED_AT, 3), (LOOKED_AT, 7), (KNOWN, 7), (KNOWN, 4), (LOOKED_AT, 2)],
)
def test_an_object_that_left_the_images_is_found_as_soon_as_it_is_back(
    how: str, seed: int, tracked: Track
) -> None:
    # It is wholly in view again in images 48 to 64 and 103 to 119. While it was sought in whole
    # images only after 15, and in any orientation, it was found up to five images later.
    found = tracked("leaves", how, seed)
    right = dict(zip(found.index.tolist(), (~found.wrong).tolist(), strict=True))
    assert all(right[index] for index in (*range(48, 65), *range(103, 120)))
    assert not found.trusted_wrong.any()


@pytest.mark.extended
@pytest.mark.parametrize(("seed", "size_px"), [(5, SMALL), (4, FULL)])
def test_an_object_that_comes_back_in_other_light_is_found_by_pictures_of_its_sides(
    seed: int, size_px: tuple[int, int], course: Draw, tmp_path: Path
) -> None:
    # By colours alone it was not found, with both seeds, in any of the last 17 images.
    capture = open_capture(course("leaves", seed, size_px))
    lamps = VARIANTS["lamps"].change(capture, seed, tmp_path)
    tracked = tracks_through(lamps, None, Request(seed=seed))[0].tracked
    truth, vertices = (
        true_poses(course("leaves", seed, size_px)),
        LEAVING_COURSES["leaves"].vertices(seed),
    )
    found = verdicts(tracked, truth, vertices)
    assert not found.wrong[found.index >= 110].any()
    assert not found.trusted_wrong.any()


@pytest.mark.extended
def test_an_object_that_turns_in_small_images_is_followed_all_the_way(tracked: Track) -> None:
    # While highlights counted as much as print, 19 of 59 poses were wrong, up to 70 degrees.
    assert not tracked("turn", LOOKED_AT, 0).wrong.any()


@pytest.mark.parametrize("seed", tiered(range(4), 2))
def test_a_plain_object_sways_as_its_outline_tells_not_its_shading(
    seed: int, tracked: Track
) -> None:
    found = tracked("plain", KNOWN, seed)
    assert plain_sway.beyond(off_figures(found)) == []


@pytest.mark.parametrize("seed", tiered(range(1, 6, 2), 1))
def test_the_outline_of_a_known_shape_tells_its_turn_where_nothing_is_printed(
    seed: int, tracked: Track
) -> None:
    found = tracked("plain", KNOWN, seed)
    told = found.tracking
    assert told.mean() >= 0.3 and not found.trusted_wrong.any()  # 0.41 to 0.47 was measured
    assert np.degrees(found.turn[told].max()) < 10.0  # 2.2 to 5.1
    # What is claimed holds, and is not much more than the errors: 0.09 to 0.67 was measured.
    assert 0.06 < np.quantile(found.surprise[told, 1], 0.95) / chi2.ppf(0.95, 3) < 1.0


@pytest.mark.extended
@pytest.mark.parametrize("seed", (10, 7))
def test_the_shading_of_a_plain_object_that_turns_is_no_print_by_which_its_turn_is_trusted(
    seed: int, tracked: Track
) -> None:
    # 3 images in a row were wrong by 15 to 26 degrees, of a mug and of two ellipsoids.
    assert not tracked("plain that turns", LOOKED_AT, seed, FULL).trusted_wrong.any()


@pytest.mark.extended
@pytest.mark.parametrize(("seed", "variant"), [(7, "half size"), (1, "noise")])
def test_a_guess_of_the_body_does_not_hold_back_a_turn_that_outlines_tell(
    seed: int, variant: str, course: Draw, tmp_path: Path
) -> None:
    # While it did, 5 and 2 images in a row were wrong, and the median error was 8 and 12 degrees.
    capture = VARIANTS[variant].change(open_capture(course("plain", seed, FULL)), seed, tmp_path)
    tracked = tracks_through(capture, None, Request(seed=seed))[0].tracked
    truth, vertices = true_poses(course("plain", seed, FULL)), COURSES["plain"].vertices(seed)
    found = verdicts(tracked, truth, vertices)
    assert not found.trusted_wrong.any()
    assert np.degrees(np.median(found.turn)) < 5.0  # 1.7 and 4.0


@pytest.mark.extended
@pytest.mark.parametrize(("how", "size_px", "seed"), SPINS)
def test_nothing_tells_the_spin_of_a_plain_skittle(
    how: str, size_px: tuple[int, int], seed: int, tracked: Track
) -> None:
    found = tracked("skittle", how, seed, size_px)
    assert not found.trusted_wrong.any() and found.tracking.mean() <= 0.1


@pytest.mark.parametrize(
    ("name", "how", "seed", "size_px"),
    tiered(
        [
            ("tower", LOOKED_AT, 0, SMALL),
            ("tower", LOOKED_AT, 0, FULL),
            ("lamp", LOOKED_AT, 0, FULL),
            ("tower", KNOWN, 0, FULL),
            ("tower", LOOKED_AT, 2, SMALL),
        ],
        1,
    ),
)
def test_creases_that_stay_where_they_are_tell_no_spin(
    name: str, how: str, seed: int, size_px: tuple[int, int], tracked: Track
) -> None:
    found = tracked(name, how, seed, size_px)
    # As these creases have the contrast of print, 33, 50, 4, 47 and 15 of 59 images were wrong.
    assert not found.trusted_wrong.any() and found.tracking.mean() <= 0.1


@pytest.mark.extended
def test_creases_tell_no_spin_to_a_single_camera_either(course: Draw) -> None:
    found = followed("tower", KNOWN, 2, course("tower", 2, FULL), cameras=1)
    assert not found.trusted_wrong.any() and found.tracking.mean() <= 0.1  # 30 of 59 were wrong


@pytest.mark.extended
def test_outlines_tell_no_spin_of_a_plain_bottle_in_small_images(tracked: Track) -> None:
    found = tracked("plain bottle", LOOKED_AT, 1)
    assert not found.trusted_wrong.any()  # 8 of 59 were, 105 to 140 degrees off


@pytest.mark.parametrize(("how", "seed"), tiered(list(product((KNOWN, LOOKED_AT), (2, 3, 1))), 1))
def test_the_spin_of_a_bottle_is_not_told_where_its_label_turned_away(
    how: str, seed: int, tracked: Track
) -> None:
    found = tracked("labelled bottle", how, seed, FULL)
    assert not found.trusted_wrong.any()
    # It turns by 90 degrees until then. While the label leaves, what the bare side may hold back is
    # doubted: with one seed of six, two more images were reported before that was so.
    assert found.tracking[:23].all()


@pytest.mark.extended
def test_the_spin_of_a_bottle_is_told_again_once_its_label_is_back(tracked: Track) -> None:
    found = tracked("labelled bottle", KNOWN, 1, FULL)
    assert not found.tracking[35:60].any()  # the label is away
    assert found.tracking[60:].sum() >= 5  # 19 were measured


@pytest.mark.parametrize("seed", tiered((2, 3, 8), 1))
def test_the_shading_of_a_smooth_toy_is_no_pattern_by_which_its_turn_is_trusted(
    seed: int, tracked: Track
) -> None:
    if not MESHES.is_dir():
        pytest.skip("the meshes lie beside the repository, and not here")
    found = tracked("toys", LOOKED_AT, seed)
    assert found.longest_wrong <= 1


@pytest.mark.extended
@pytest.mark.parametrize(("seed", "size_px"), [(9, FULL), (10, FULL), (23, FULL), (13, SMALL)])
def test_a_smooth_toy_whose_turn_was_long_unknown_is_not_trusted_again_by_its_shading(
    seed: int, size_px: tuple[int, int], tracked: Track
) -> None:
    if not MESHES.is_dir():
        pytest.skip("the meshes lie beside the repository, and not here")
    # 21, 5, 8 and 4 images were wrong by 15 to 22 degrees.
    assert not tracked("toys", LOOKED_AT, seed, size_px).trusted_wrong.any()


@pytest.mark.extended
@pytest.mark.parametrize("seed", [1, 5])
def test_shading_that_holds_a_toy_back_is_part_of_what_is_claimed(
    seed: int, tracked: Track
) -> None:
    if not MESHES.is_dir():
        pytest.skip("the meshes lie beside the repository, and not here")
    found = tracked("toys", LOOKED_AT, seed, FULL)
    told = found.tracking
    # 0.91 and 0.90 of 46 and 40 images; 0.33 and 0.73 while only drift and noise counted.
    assert (found.surprise[told, 1] <= chi2.ppf(0.95, 3)).mean() >= 0.8


def track_of(
    poses: Sequence[Pose], statuses: Sequence[str], covariance: np.ndarray | None = None
) -> Any:
    """Return what a tracker would have said."""
    spread = np.eye(6) if covariance is None else covariance
    return [
        SimpleNamespace(
            index=index,
            estimate=SimpleNamespace(
                world_from_object=pose, status=status, confidence=0.7, covariance=spread
            ),
        )
        for index, (pose, status) in enumerate(zip(poses, statuses, strict=True))
    ]


def shifted(*metres: float) -> list[Pose]:
    return [Pose.from_parts((one, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0)) for one in metres]


def test_runs_and_losses_count_images_of_which_the_truth_is_known() -> None:
    truth: list[Pose | None] = [*shifted(*[0.0] * 9)]
    truth[3] = None
    statuses = ["tracking"] * 6 + ["searching"] * 2 + ["tracking"]
    found = verdicts(
        track_of(shifted(0, 0, 0.03, 0.03, 0.03, 0.01, 0.01, 0.01, 0), statuses), truth, POINTS
    )
    assert found.index.tolist() == [1, 2, 4, 5, 6, 7, 8]
    assert found.trusted_wrong.tolist() == [False, True, True, False, False, False, False]
    assert (found.longest_wrong, found.losses) == (2, [3, 2])
    never = verdicts(track_of(shifted(0, 0.1), ["tracking"] * 2), shifted(0, 0), POINTS)
    assert never.losses == [None]
    assert stretches(np.zeros(4, bool)) == []


def test_a_turn_of_more_than_15_degrees_is_wrong_and_so_is_more_than_20_mm() -> None:
    for off, wrong in ((0.019, False), (0.021, True)):
        track = track_of(shifted(0.0, off), ["tracking"] * 2)
        assert verdicts(track, shifted(0.0, 0.0), POINTS).wrong.tolist() == [wrong]
    for degrees, wrong in ((14.9, False), (15.1, True)):
        turned = Pose.exp([0.0, 0.0, 0.0, np.radians(degrees), 0.0, 0.0])
        track = track_of([Pose.identity(), turned], ["tracking"] * 2)
        assert verdicts(track, [Pose.identity()] * 2, POINTS).wrong.tolist() == [wrong]


def test_the_frame_of_the_body_and_the_scale_of_one_camera_are_no_errors() -> None:
    random = np.random.default_rng(0)
    truth = [Pose.exp((0.05 * random.normal(size=6)).tolist()) for _ in range(20)]
    body = Pose.exp([0.02, -0.01, 0.03, 0.4, 0.8, -1.2])
    track = track_of([one @ body for one in truth], ["tracking"] * 20)
    assert verdicts(track, truth, POINTS).add.max() < 1e-12
    scale = float(np.exp(0.25))
    larger = [
        Pose.from_parts([scale * part for part in one.translation], one.quaternion)
        for one in (pose @ body for pose in truth)
    ]
    track = track_of(larger, ["tracking"] * 20)
    assert verdicts(track, truth, POINTS, scaled=True).add.max() < 1e-9
    assert verdicts(track, truth, POINTS).add.max() > 1e-3


def test_errors_that_a_covariance_foretells_are_covered_as_often_as_it_says() -> None:
    random = np.random.default_rng(0)
    root = 0.002 * random.normal(size=(6, 6))
    body = Pose.exp([0.02, -0.01, 0.03, 0.4, 0.8, -1.2])
    truth = [Pose.exp((0.1 * random.normal(size=6)).tolist()) for _ in range(1500)]
    noise = [
        Pose.identity(),
        *(Pose.exp((root @ one).tolist()) for one in random.normal(size=(1499, 6))),
    ]
    track = track_of(
        [one @ body @ off for one, off in zip(truth, noise, strict=True)],
        ["tracking"] * 1500,
        root @ root.T,
    )
    surprise = verdicts(track, truth, POINTS).surprise
    for column, freedom in enumerate((3, 3, 6)):
        assert np.mean(surprise[:, column]) == pytest.approx(freedom, rel=0.15)
