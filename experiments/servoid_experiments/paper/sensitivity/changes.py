"""The sensitivity to the constants that the paper does not state: each is changed alone."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from servoid.batch import Experiment
from servoid_experiments.design import Work
from servoid_experiments.paper.servoing.settings import (
    Constants,
    Positive,
    constants,
    with_constant,
)
from servoid_experiments.paper.servoing.trial import ServoingCase, ServoingRow, run_servoing

BASE = "as assumed"
_FIXED = ("Eq", "Sec", "Title")  # constants that the paper states are not changed

# Runs with a number of their own: those of the base are not shared with another study's batch.
SENSITIVITY = Experiment("sensitivity", run_servoing, ServoingCase, ServoingRow)


class Shape(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An ellipsoid that the paper may mean."""

    name: str
    radii: tuple[Positive, Positive, Positive]


class SensitivitySettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Runs of the paper's method at T = 10 s; numbers are halved and doubled unless listed here."""

    omega: Annotated[float, Meta(gt=0, description="of the object's motion, rad/s (Sec. 5.3)")] = (
        0.628
    )
    seeds: Annotated[int, Meta(ge=1, description="runs of each change")] = 1
    base_seeds: Annotated[int, Meta(ge=2, description="runs with all constants as assumed")] = 5
    settle_s: Annotated[float, Meta(ge=0, description="of motion that is not measured, s")] = 2.0
    left_out: Annotated[tuple[str, ...], Meta(description="constants that are not changed")] = (
        "scene.rest_s",
        "law.turn_rate_gain",
    )
    shapes: Annotated[
        tuple[Shape, ...], Meta(description="other ellipsoids of 90 and 45 mm, radii in m")
    ] = (
        Shape(name="long along x", radii=(0.045, 0.0225, 0.0225)),
        Shape(name="long along z", radii=(0.0225, 0.0225, 0.045)),
        Shape(name="twice as big", radii=(0.045, 0.09, 0.045)),
    )
    backgrounds: Annotated[tuple[str, ...], Meta(description="other backgrounds")] = ("cluttered",)
    links: Annotated[tuple[str, ...], Meta(description="other link lengths")] = ("jsi",)
    sizes_px: Annotated[
        tuple[tuple[int, int], ...], Meta(description="other sizes of an image")
    ] = ((160, 120), (640, 480))


def quick_sensitivity() -> SensitivitySettings:
    """Return settings of a study that takes seconds and shows only that everything works."""
    chosen = ("search.population", "law.position_gain")
    return SensitivitySettings(
        omega=4.0,
        base_seeds=2,
        settle_s=0.5,
        left_out=tuple(name for name, *_ in constants(Constants()) if name not in chosen),
    )


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """One constant with another value."""

    constant: str
    value: Any
    written: str

    @property
    def name(self) -> str:
        """Return the name of the runs with this change."""
        return f"{self.constant} = {self.written}"


def changes(settings: SensitivitySettings, given: Constants) -> list[Change]:
    """List the changes of all constants that the paper does not state."""
    found, shapes = [], {one.radii: one.name for one in settings.shapes}
    for name, _, _, source in constants(given):
        if source.startswith(_FIXED) or name in settings.left_out:
            continue
        table, key = name.split(".")
        for value in _others(settings, name, getattr(getattr(given, table), key)):
            try:
                with_constant(given, name, value)
            except msgspec.ValidationError:
                continue  # twice a share may exceed its maximum
            written = shapes.get(value, _written(value))
            found.append(Change(constant=name, value=value, written=written))
    return found


def _others(settings: SensitivitySettings, name: str, value: Any) -> tuple[Any, ...]:
    """Return other values of a constant."""
    listed: dict[str, tuple[Any, ...]] = {
        "scene.radii": tuple(one.radii for one in settings.shapes),
        "scene.background": settings.backgrounds,
        "arm.links": settings.links,
        "eyes.size_px": settings.sizes_px,
    }
    if name in listed:
        return listed[name]
    if isinstance(value, int):
        return (max(1, value // 2), 2 * value)
    return (0.5 * value, 2.0 * value)


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return " x ".join(_written(part) for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def sensitivity_work(settings: SensitivitySettings, given: Constants) -> list[Work]:
    """Return the runs, those with the constants as assumed first."""
    cases = [_case(settings, BASE, seed, given) for seed in range(settings.base_seeds)]
    cases += [
        _case(settings, one.name, seed, with_constant(given, one.constant, one.value))
        for one in changes(settings, given)
        for seed in range(settings.seeds)
    ]
    return [Work(SENSITIVITY, cases)]


def _case(settings: SensitivitySettings, name: str, seed: int, given: Constants) -> ServoingCase:
    return ServoingCase(
        name=name,
        seed=seed,
        omega=settings.omega,
        settle_s=settings.settle_s,
        periods=1,
        constants=given,
    )
