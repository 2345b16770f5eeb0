"""What a servo run consists of: one file for world, servo, tracker and the run itself."""

from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from servoid.config.checked import Checked
from servoid.config.strict import convert, read_toml
from servoid.errors import ServoError, ServoidError, TargetError
from servoid.segment import parse_target
from servoid.servo import ServoSettings, settings_toml
from servoid.sim.world import BEFORE_HAND, WorldSettings
from servoid.track import Method

BY_HAND, BY_BOX, BY_CLICK = PEOPLE = ("hand", "box", "click")
"""How a person marks an object: draws around it, draws a box, or clicks on it."""

Triple = tuple[float, float, float]
NotNegative = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=1)]


class _Settings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Is the base of settings of a run."""

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return ServoError(message)


class RunSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is done, and for how long."""

    seconds: Annotated[float, Meta(gt=0, description="of servoing, s")] = 30.0
    goal: Annotated[
        Triple,
        Meta(description="where the object's middle shall be in the hand's frame, m"),
    ] = BEFORE_HAND
    target: Annotated[
        str,
        Meta(
            description="how the object is marked in the first left image: by hand, box or click, "
            "as a person of [world.lab] does it; or as for servoid track, such as click:160,120"
        ),
    ] = BY_HAND
    trust_target: Annotated[
        bool, Meta(description="use it even if it may mean several objects")
    ] = False
    start_offset: Annotated[
        Triple, Meta(description="where the hand starts, off its goal, in the goal's frame, m")
    ] = (0.0, 0.0, 0.0)
    start_turn_deg: Annotated[
        Triple, Meta(description="its turn there, a rotation vector in the goal's frame, degrees")
    ] = (0.0, 0.0, 0.0)
    max_ellipsoids: Annotated[int, Meta(ge=1, description="of the object's body")] = 5
    settle_s: Annotated[
        float, Meta(ge=0, description="at the beginning, which the figures leave out, s")
    ] = 3.0

    def __post_init__(self) -> None:
        """Check each value before a run that would find it out late.

        Raises:
            ServoError: a value cannot be, or `target` is no way to mark an object.

        """
        super().__post_init__()
        if self.target in PEOPLE:
            return
        try:
            parse_target(self.target)
        except TargetError as error:
            raise ServoError(
                f"run.target: {error}; or choose one of {', '.join(PEOPLE)}, as a person does it"
            ) from None


class TrackingSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the object is tracked; what is not set is the tracker's own default."""

    method: Annotated[
        Method, Meta(description="region, servoid's own, or paper, the 1-step GA")
    ] = Method.REGION
    seed: Annotated[NotNegative | None, Meta(description="of the tracker's searches")] = None
    population: Annotated[Count | None, Meta(description="hypotheses a generation")] = None
    generations: Annotated[Count | None, Meta(description="generations an image")] = None
    surface: Annotated[
        bool | None,
        Meta(description="use the look of the surface; a plain, glossy object is better without"),
    ] = None

    def __post_init__(self) -> None:
        """Check each value, and what hangs together, before a run that would find it out late.

        Raises:
            ServoError: a value cannot be, or is one that the paper's method does not have.

        """
        super().__post_init__()
        if self.method is Method.PAPER and self.generations is not None:
            raise ServoError(
                f"generations is {self.generations}, but the paper's method has one an image; "
                "leave it out, or choose the method region"
            )
        if self.method is Method.PAPER and self.surface is not None:
            raise ServoError(
                "surface was given, but the paper's method does not look at the surface; leave it "
                "out, or choose the method region"
            )

    def options(self) -> dict[str, Any]:
        """Return what was set, as the tracker's maker takes it."""
        names = ("seed", "population", "generations", "surface")
        values = {name: getattr(self, name) for name in names}
        return {name: value for name, value in values.items() if value is not None}


class TrialSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A servo run in a simulated world."""

    run: RunSettings = RunSettings()
    world: WorldSettings = WorldSettings()
    track: TrackingSettings = TrackingSettings()
    servo: ServoSettings = ServoSettings()


def read_trial_settings(path: str | Path) -> TrialSettings:
    """Read the settings of a run from a TOML file; what it leaves out keeps its default.

    Raises:
        ServoError: the file cannot be read, a key is unknown, or a value cannot be.

    """
    return read_toml(Path(path), TrialSettings, ServoError)


def changed(settings: TrialSettings, values: dict[str, Any], place: str) -> TrialSettings:
    """Return settings with other values; keys are dotted, such as `world.object.name`.

    `place` says where the values come from, for errors.

    Raises:
        ServoError: a key is unknown, or a value cannot be.

    """
    data: dict[str, Any] = msgspec.to_builtins(settings)
    for key, value in values.items():
        *tables, last = key.split(".")
        inner = data
        for table in tables:
            if not isinstance(inner.get(table), dict):
                inner[table] = {}  # which is refused with what is known there
            inner = inner[table]
        inner[last] = value
    return convert(data, TrialSettings, place, ServoError)


def trial_toml(settings: TrialSettings | None = None) -> str:
    """Return all settings of a run as commented TOML, which reads back equal."""
    return settings_toml(settings or TrialSettings())
