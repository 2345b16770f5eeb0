"""Reads the description of an arm, such as `arms/pa10.toml`."""

from pathlib import Path
from typing import Annotated

import msgspec
import msgspec.toml
from msgspec import Meta

from servoid.errors import SimError
from servoid.words import suggestion

_FOLDER = Path(__file__).with_name("arms")

Numbers = tuple[float, ...]
PoseNumbers = Annotated[tuple[float, ...], Meta(min_length=7, max_length=7)]


class Chain(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Joints by modified Denavit-Hartenberg parameters; `links` chooses one of the lengths."""

    twists_deg: Numbers
    links: str
    lengths: dict[str, Numbers]


class JointLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The limits of the arm's joints, their masses, and the lag of their servos."""

    names: tuple[str, ...]
    lower_deg: Numbers
    upper_deg: Numbers
    speed_deg: Numbers
    acceleration_deg: Numbers
    lag_s: float
    torque: Numbers
    mass: Numbers


class Hand(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The hand frame on the flange, (w, x, y, z, tx, ty, tz), and the hand's mass."""

    flange_from_hand: PoseNumbers
    mass: float


class EyeLimits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The limits of the tilt and the two pans."""

    names: tuple[str, ...]
    half_baseline: float
    lower_deg: Numbers
    upper_deg: Numbers
    speed_deg: Numbers
    acceleration_deg: Numbers
    lag_s: float
    torque: Numbers


class Start(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The start pose of the hand."""

    world_from_hand: PoseNumbers


class ArmFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A chain of joints with a head of two moving cameras."""

    chain: Chain
    joints: JointLimits
    hand: Hand
    eyes: EyeLimits
    start: Start

    @property
    def lengths(self) -> Numbers:
        """Return d1, d3, d5 and d7 of the chosen set, in metres."""
        return self.chain.lengths[self.chain.links]


def read_arm(name: str = "pa10", links: str | None = None) -> ArmFile:
    """Read a shipped arm; `links` selects another set of lengths than the file's default.

    Raises:
        SimError: there is no such arm, or no such set of lengths.

    """
    path = _FOLDER / f"{name}.toml"
    if not path.is_file():
        known = sorted(file.stem for file in _FOLDER.glob("*.toml"))
        raise SimError(
            f"unknown arm '{name}'; choose {', '.join(known)}, or give the path of an arm's MJCF "
            f"or URDF file{suggestion(name, known)}"
        )
    arm = msgspec.toml.decode(path.read_bytes(), type=ArmFile)
    if links is None:
        return arm
    if links not in arm.chain.lengths:
        known = ", ".join(arm.chain.lengths)
        raise SimError(f"unknown lengths '{links}' of {name}; choose one of {known}")
    return msgspec.structs.replace(arm, chain=msgspec.structs.replace(arm.chain, links=links))
