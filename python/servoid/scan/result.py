"""The result of a scan: the solution, its scale, and messages for the user on both."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from servoid._native import Lens
from servoid.brief import said
from servoid.camera import off_center_note
from servoid.scan.lookalikes import lookalikes
from servoid.scan.metres.scale import Scale
from servoid.scan.solution import Solution
from servoid.words import counted, finite

_LITTLE_PARALLAX_RAD = math.radians(5.0)
_MANY_MISSING = 0.2
_LARGE_ERROR = 0.001  # of the diagonal
_OUTLYING = 2.0  # times the error of an image in the median
_ROUGH_FOCAL = 0.01
_FEW_IMAGES = 8
_CLOSE_FOCAL, _SURE = (
    0.03,
    5.0,
)  # share, and standard deviations, of an accepted difference
_ONE_SIDE_RAD = math.radians(60.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Scan:
    """The poses of the camera, in a capture at `path`.

    There were `count` images, of which `keys` were used. Without `scale`, the median distance from
    the cameras to the points is 1. `times` are seconds by stage. `notes` are messages for the user
    besides `doubts`, and `image_doubts` are doubts that the images raise before they are scanned.
    """

    source: Path
    path: Path
    count: int
    keys: int
    solution: Solution
    scale: Scale | None
    times: dict[str, float]
    notes: tuple[str, ...] = ()
    given_lens: Lens | None = None
    image_doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return said(
            Scan,
            str(self.path),
            f"{len(self.solution.names)} of {counted(self.keys, 'used image')} placed",
            "without scale" if self.scale is None else "in metres",
        )

    @property
    def seconds(self) -> float:
        """Return the total duration."""
        return sum(self.times.values())

    @cached_property
    def around_rad(self) -> float:
        """Return the largest angle between the directions from which the scene was seen."""
        middle = np.median(self.solution.points, axis=0)
        toward = self.solution.places - middle
        toward = toward / np.linalg.norm(toward, axis=1)[:, None]
        return float(np.arccos(np.clip((toward @ toward.T).min(), -1.0, 1.0)))

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Return messages on what makes the scan doubtful."""
        return tuple(self._doubts())

    @cached_property
    def pose_doubts(self) -> tuple[str, ...]:
        """Return those of the doubts by which the poses, and what is made of them, are wrong."""
        return tuple(self._pose_doubts())

    def _pose_doubts(self) -> Iterator[str]:
        yield from self.image_doubts
        solution = self.solution
        if solution.zoomed_px is not None:
            first_px, second_px = solution.zoomed_px
            yield (
                f"the first half of the images fits a focal length of {first_px:.0f} px, the "
                f"second {second_px:.0f}: the zoom or the focus was changed, so that poses and "
                "points are wrong; keep both fixed, or scan the images of each zoom alone"
            )
        alike = lookalikes(solution)
        if alike:
            pairs = tuple(" and ".join(pair.names) for pair in alike)
            yield (
                f"{_some(pairs)} have nearly one pose, but see different things, in up to "
                f"{100.0 * alike[0].share:.0f} % of an image: they may show sides of the object "
                "that look alike, such as front and back of a box, so that poses and points are "
                "wrong; make the sides differ, as with a sticker on one, and hold still what moved"
            )

    def _doubts(self) -> Iterator[str]:
        solution = self.solution
        if self.scale is None:
            yield (
                "the scale is unknown, so lengths are not in metres: the median distance from the "
                "camera to the scene is set to 1; give --length in two images, --board or "
                "--apart"
            )
        if len(solution.missing) > _MANY_MISSING * self.keys:
            yield (
                f"{len(solution.missing)} of {counted(self.keys, 'image')} have no pose: "
                f"{_some(solution.missing)}; they overlap too little with the others"
            )
        if solution.parallax_rad < _LITTLE_PARALLAX_RAD:
            yield (
                f"the camera moved little sideways: the parallax of points is "
                f"{math.degrees(solution.parallax_rad):.1f} degrees, so that distances and the "
                "focal length are inaccurate; walk further around the object"
            )
        if solution.rms_px > _LARGE_ERROR * self._diagonal_px:
            yield (
                f"the reprojection error is {solution.rms_px:.2g} px, more than "
                f"{_LARGE_ERROR * self._diagonal_px:.2g}: blur, a rolling shutter, a zoom that "
                "changed, images that were stretched, or something that moved"
            )
        yield from self._outlying()
        aside = off_center_note("the scan", solution.lens)
        if aside is not None and solution.center_is_found:
            yield f"{aside}; or they were stretched, so that pixels are not square"
        if solution.focal_std_px >= _ROUGH_FOCAL * solution.focal_px:
            yield (
                f"the standard deviation of the focal length is {solution.focal_std_px:.0f} of "
                f"{solution.focal_px:.0f} px"
            )
        yield from self.pose_doubts
        yield from self._focal_contradiction()
        if len(solution.names) < _FEW_IMAGES:
            yield f"only {counted(len(solution.names), 'image')} have poses; take more"
        if self.around_rad < _ONE_SIDE_RAD:
            yield (
                "the scene was seen from one side: directions differ by "
                f"{math.degrees(self.around_rad):.0f} degrees at most; the rear stays unknown"
            )

    @property
    def _diagonal_px(self) -> float:
        return math.hypot(*self.solution.lens.size_px)

    def _outlying(self) -> Iterator[str]:
        """Name the images that fit much worse than the others."""
        errors = self.solution.error_px
        usual_px = float(np.median(errors))
        least_px = max(_OUTLYING * usual_px, _LARGE_ERROR * self._diagonal_px)
        worst = [int(at) for at in np.argsort(-errors, kind="stable") if errors[at] > least_px]
        if worst:
            names = tuple(f"{self.solution.names[at]} ({errors[at]:.2g} px)" for at in worst)
            yield (
                f"of {_some(names)} the reprojection error is more than twice that of the others, "
                f"{usual_px:.2g} px in the median: look at {'it' if len(worst) == 1 else 'them'}, "
                "and scan again without what is blurred or moved"
            )

    def _focal_contradiction(self) -> Iterator[str]:
        """Report if the given focal length contradicts the images."""
        if self.given_lens is None:
            return
        solution = self.solution
        given_px = float(np.mean(self.given_lens.focal_px))
        if solution.parallax_rad < _LITTLE_PARALLAX_RAD:
            return  # then the images hardly determine it
        sure_px = max(_SURE * solution.focal_std_px, _CLOSE_FOCAL * solution.focal_px)
        if abs(given_px - solution.focal_px) > sure_px:
            fov_deg = 2.0 * math.atan(0.5 * solution.lens.size_px[0] / solution.focal_px)
            yield (
                f"the images fit a focal length of about {solution.focal_px:.0f} px better than "
                f"the given {given_px:.0f} px: {math.degrees(fov_deg):.1f} degrees from "
                "left to right; the scan uses its own estimate"
            )

    def numbers(self) -> dict[str, Any]:
        """Return all figures for scan.json, in radians, pixels, seconds and the scan's unit."""
        solution, scale = self.solution, self.scale
        return {
            "version": 1,
            "images": {"all": self.count, "used": self.keys, "found": len(solution.names)},
            "missing": list(solution.missing),
            "size_px": list(solution.lens.size_px),
            "focal_px": solution.focal_px,
            "focal_std_px": finite(solution.focal_std_px),
            "center_px": list(solution.lens.center_px),
            "center_is_found": solution.center_is_found,
            "distortion": list(solution.lens.distortion[:1]),
            "rms_px": solution.rms_px,
            "points": len(solution.points),
            "parallax_rad": solution.parallax_rad,
            "around_rad": self.around_rad,
            "distance": solution.distance,
            "scale": None
            if scale is None
            else {"by": scale.words, "relative_std": finite(scale.deviation)},
            "by_image": [
                {"name": name, "error_px": float(error), "points": len(seen)}
                for name, error, seen in zip(
                    solution.names, solution.error_px, solution.seen, strict=True
                )
            ],
            "seconds": {stage: round(value, 2) for stage, value in self.times.items()},
            "notes": [*self.notes, *self.doubts],
            "pose_doubts": list(self.pose_doubts),
        }


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names if len(names) <= 5 else [*names[:4], "..."])
