"""Declares the settings of a servo run: world, servo, tracker and the run itself, in one file."""

from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from servoid.config import NEAR_M, Checked, Most, convert, read_toml
from servoid.errors import ServoError, TargetError
from servoid.segment import parse_target
from servoid.servo import ServoSettings, settings_toml
from servoid.shape import Body
from servoid.sim.world import BEFORE_HAND, WorldSettings
from servoid.track import Method
from servoid.words import digits, measured

BY_HAND, BY_BOX, BY_CLICK = PEOPLE = ("hand", "box", "click")
"""How a person marks an object: draws around it, draws a box, or clicks on it."""

_ROUNDING_S = 1e-9

Triple = tuple[float, float, float]
NotNegative = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=1)]
_HALF_TURN_DEG = 180.0


class _Settings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The base class of the settings of a run."""

    REFUSAL = ServoError


class RunSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The task of a run and its duration."""

    seconds: Annotated[float, Meta(gt=0, description="duration of servoing, s")] = 30.0
    goal: Annotated[
        Triple,
        Most(NEAR_M),
        Meta(
            description="desired position of the object's centre in the hand's frame, z forward, m"
        ),
    ] = BEFORE_HAND
    target: Annotated[
        str,
        Meta(
            description="how the object is marked in the first left image: hand, box or click, "
            "with a person's error, that of world.lab; or mask:FILE, box:U0,V0,U1,V1, click:U,V "
            "or hue:LOW..HIGH, as for servoid track"
        ),
    ] = BY_HAND
    trust_target: Annotated[
        bool, Meta(description="use a target even if it may mean several objects")
    ] = False
    trust_calibration: Annotated[
        bool, Meta(description="servo even if images contradict the calibration of cameras or arm")
    ] = False
    start_offset: Annotated[
        Triple,
        Most(NEAR_M),
        Meta(description="initial offset of the hand from its goal, in the goal's frame, m"),
    ] = (0.0, 0.0, 0.0)
    start_turn_deg: Annotated[
        Triple, Meta(description="initial rotation vector of the hand in the goal's frame, degrees")
    ] = (0.0, 0.0, 0.0)
    max_ellipsoids: Annotated[
        int, Meta(ge=1, le=Body.MAX_ELLIPSOIDS, description="most ellipsoids of the body")
    ] = 5
    settle_s: Annotated[
        float, Meta(ge=0, description="settling time, which the figures leave out, s")
    ] = 3.0

    def __post_init__(self) -> None:
        """Check each value before the run starts.

        Raises:
            ServoError: a value is out of range, `goal` is behind the hand, or `target` does not
                describe a target.

        """
        super().__post_init__()
        farthest = max(self.start_turn_deg, key=abs)
        if abs(farthest) > _HALF_TURN_DEG:
            raise ServoError(
                f"run.start_turn_deg: a rotation by {digits(farthest)} degrees; give at most "
                f"{digits(_HALF_TURN_DEG)} degrees, as farther ones are shorter the other way"
            )
        if not self.goal[2] > 0.0:
            raise ServoError(
                f"run.goal: the object's centre is to be {digits(self.goal[2])} m in front of the "
                "hand, which looks forward; give a third number above 0, such as "
                f"{BEFORE_HAND[2]:g}"
            )
        if self.target in PEOPLE:
            return
        try:
            parse_target(self.target)
        except TargetError as error:
            raise ServoError(
                f"run.target: {error}; or choose one of {', '.join(PEOPLE)}, with a person's error"
            ) from None


class TrackingSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the object is tracked; values that are not set keep the tracker's own defaults."""

    method: Annotated[
        Method, Meta(description="how to track: region, servoid's own, or paper, the 1-step GA")
    ] = Method.REGION
    seed: Annotated[NotNegative | None, Meta(description="seed of the tracker's searches")] = None
    population: Annotated[Count | None, Meta(description="hypotheses per generation")] = None
    generations: Annotated[Count | None, Meta(description="generations per image")] = None
    surface: Annotated[
        bool | None,
        Meta(description="use the surface texture; plain, glossy objects are better without"),
    ] = None

    def __post_init__(self) -> None:
        """Check each value, and the values that depend on each other, before the run starts.

        Raises:
            ServoError: a value is out of range, or the paper's method has no such setting.

        """
        super().__post_init__()
        if self.method is Method.PAPER and self.generations is not None:
            raise ServoError(
                f"generations is {self.generations}, but the paper's method has one per image; "
                "leave it out, or choose the method region"
            )
        if self.method is Method.PAPER and self.surface is not None:
            raise ServoError(
                "surface was given, but the paper's method does not use the surface; leave it "
                "out, or choose the method region"
            )

    def options(self) -> dict[str, Any]:
        """Return the values that were set, as keyword arguments of the tracker."""
        values = msgspec.structs.asdict(self)
        del values["method"]
        return {name: value for name, value in values.items() if value is not None}


class TrialSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All settings of a servo run in a simulated world."""

    run: RunSettings = RunSettings()
    world: WorldSettings = WorldSettings()
    track: TrackingSettings = TrackingSettings()
    servo: ServoSettings = ServoSettings()


def read_trial_settings(path: str | Path) -> TrialSettings:
    """Read the settings of a run from a TOML file; keys that it leaves out keep their defaults.

    Raises:
        ServoError: the file cannot be read, a key is unknown, or a value is out of range.

    """
    return read_toml(Path(path), TrialSettings, ServoError)


def changed(settings: TrialSettings, values: dict[str, Any], place: str) -> TrialSettings:
    """Return settings with other values; keys are dotted, such as `world.object.name`.

    `place` names the source of the values in error messages.

    Raises:
        ServoError: a key is unknown, or a value is out of range.

    """
    data: dict[str, Any] = msgspec.to_builtins(settings)
    for key, value in values.items():
        *tables, last = key.split(".")
        inner = data
        for table in tables:
            if not isinstance(inner.get(table), dict):
                inner[table] = {}  # refused below, with the known keys
            inner = inner[table]
        inner[last] = value
    return convert(data, TrialSettings, place, ServoError)


def check_events(settings: TrialSettings) -> None:
    """Check that each fault, and the step of the light, begins before the end of the run.

    A file may hold a later one if an option makes the run longer, so this is checked only when a
    run starts.

    Raises:
        ServoError: one would never happen.

    """
    world, end_s = settings.world, settings.run.seconds
    starts = {f"world.faults[{index}].at_s": one.at_s for index, one in enumerate(world.faults)}
    if world.light.step_at_s is not None:
        starts["world.light.step_at_s"] = world.light.step_at_s
    for key, start_s in starts.items():
        if start_s >= end_s:
            raise ServoError(
                f"{key} is {digits(start_s)} s, but servoing ends after {digits(end_s)} s, so that "
                f"this never happens; give a time below {digits(end_s)}, or raise run.seconds"
            )


def check_ages(settings: TrialSettings) -> None:
    """Check that images come often and early enough for the arm to move.

    The arm is held when the newest image is older than `servo.safety.coast_s`.

    Raises:
        ServoError: they get older before the next one comes, so that the arm would stay held.

    """
    cameras, coast_s = settings.world.cameras, settings.servo.safety.coast_s
    track_s, interval_s = settings.world.in_effect.track_s, 1.0 / cameras.rate_hz
    # A tracker that takes longer than the interval misses images: it gets them this old at least.
    oldest_s = cameras.latency_s + track_s + max(interval_s, track_s)
    if oldest_s > coast_s + _ROUNDING_S:
        raise ServoError(
            f"an image would be {measured(oldest_s)} s old before the next one comes "
            f"(world.cameras.latency_s {digits(cameras.latency_s)} s, the interval at "
            f"world.cameras.rate_hz {digits(cameras.rate_hz)} {measured(interval_s)} s, and "
            f"world.lab.track_s {digits(track_s)} s), but the arm is held from "
            f"{digits(coast_s)} s on (servo.safety.coast_s), so that it would stay held; raise "
            f"servo.safety.coast_s above {measured(oldest_s)}, lower latency_s, or raise rate_hz"
        )


def trial_toml(settings: TrialSettings | None = None) -> str:
    """Return all settings of a run as commented TOML, which reads back equal."""
    return settings_toml(settings or TrialSettings())
