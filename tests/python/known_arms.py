"""Arms that laboratories have, as URDF files that a test makes from their published dimensions."""

import math
from dataclasses import dataclass

from servoid.sim.world import ArmSettings

_HALF = math.pi / 2.0
Row = tuple[float, float, float]  # turn about x, shift along it, shift along z


@dataclass(frozen=True)
class KnownArm:
    """A chain: where each joint sits in the frame before it, and what it may do."""

    name: str
    joints: tuple[tuple[float, tuple[float, float, float]], ...]  # roll, place
    flange: tuple[float, tuple[float, float, float]]
    limits: tuple[tuple[float, float, float, float], ...]  # lower, upper, speed, effort
    start: tuple[float, ...]
    radius: float = 0.045

    @property
    def urdf(self) -> str:
        """Write the arm as a URDF with a capsule-like cylinder along each link."""
        places = [*self.joints, self.flange]
        links = [_link(self.name, 0, places[0][1], self.radius)]
        joints = []
        for index, ((roll, place), limit) in enumerate(zip(self.joints, self.limits, strict=True)):
            links.append(_link(self.name, index + 1, places[index + 1][1], self.radius))
            joints.append(_joint(self.name, index, roll, place, limit))
        roll, place = self.flange
        joints.append(
            f'<joint name="fixed" type="fixed"><parent link="{self.name}{len(self.joints)}"/>'
            f'<child link="flange"/>{_origin(roll, place)}</joint>'
        )
        body = "\n".join((*links, '<link name="flange"/>', *joints))
        return f'<robot name="{self.name}">{body}</robot>'

    def settings(self, path: str) -> ArmSettings:
        """Return the settings of a world with the arm, whose URDF is at a path."""
        ahead = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1)
        return ArmSettings(name=path, mount="flange", mount_from_hand=ahead, start=self.start)


def _origin(roll: float, place: tuple[float, float, float]) -> str:
    x, y, z = place
    return f'<origin rpy="{roll} 0 0" xyz="{x} {y} {z}"/>'


def _link(name: str, index: int, toward: tuple[float, float, float], radius: float) -> str:
    """Write a link that reaches from its joint to the next one."""
    length = math.hypot(*toward)
    shape = ""
    if length > 2.0 * radius:
        x, y, z = (part / length for part in toward)
        pitch, yaw = math.acos(z), math.atan2(y, x)
        middle = " ".join(str(0.5 * part) for part in toward)
        shape = (
            f'<collision><origin xyz="{middle}" rpy="0 {pitch} {yaw}"/>'
            f'<geometry><cylinder radius="{radius}" length="{length - radius}"/></geometry>'
            "</collision>"
        )
    return f'<link name="{name}{index}">{shape}</link>'


def _joint(
    name: str,
    index: int,
    roll: float,
    place: tuple[float, float, float],
    limit: tuple[float, float, float, float],
) -> str:
    lower, upper, speed, effort = limit
    return (
        f'<joint name="j{index + 1}" type="revolute"><parent link="{name}{index}"/>'
        f'<child link="{name}{index + 1}"/>{_origin(roll, place)}<axis xyz="0 0 1"/>'
        f'<limit lower="{lower}" upper="{upper}" velocity="{speed}" effort="{effort}"/></joint>'
    )


def _by_standard(rows: list[Row]) -> tuple[tuple[float, tuple[float, float, float]], ...]:
    """Return places of frames by Denavit and Hartenberg, (α, a, d) each, the base before them."""
    return ((0.0, (0.0, 0.0, 0.0)), *((alpha, (a, 0.0, d)) for alpha, a, d in rows))


def _by_modified(rows: list[Row]) -> tuple[tuple[float, tuple[float, float, float]], ...]:
    """Return places of frames by Craig's modification."""
    return tuple((alpha, (a, -math.sin(alpha) * d, math.cos(alpha) * d)) for alpha, a, d in rows)


_UR = _by_standard(
    [
        (_HALF, 0.0, 0.1625),
        (0.0, -0.425, 0.0),
        (0.0, -0.3922, 0.0),
        (_HALF, 0.0, 0.1333),
        (-_HALF, 0.0, 0.0997),
        (0.0, 0.0, 0.0996),
    ]
)
UR5E = KnownArm(
    name="ur",
    joints=_UR[:6],
    flange=_UR[6],
    limits=((-6.28, 6.28, 3.14, 150.0),) * 3 + ((-6.28, 6.28, 3.14, 28.0),) * 3,
    start=(0.2, -1.2, 2.0, -0.8, 1.77, 1.57),
)
PANDA = KnownArm(
    name="panda",
    joints=_by_modified(
        [
            (0.0, 0.0, 0.333),
            (-_HALF, 0.0, 0.0),
            (_HALF, 0.0, 0.316),
            (_HALF, 0.0825, 0.0),
            (-_HALF, -0.0825, 0.384),
            (_HALF, 0.0, 0.0),
            (_HALF, 0.088, 0.0),
        ]
    ),
    flange=(0.0, (0.0, 0.0, 0.107)),
    limits=(
        (-2.8973, 2.8973, 2.175, 87.0),
        (-1.7628, 1.7628, 2.175, 87.0),
        (-2.8973, 2.8973, 2.175, 87.0),
        (-3.0718, -0.0698, 2.175, 87.0),
        (-2.8973, 2.8973, 2.61, 12.0),
        (-0.0175, 3.7525, 2.61, 12.0),
        (-2.8973, 2.8973, 2.61, 12.0),
    ),
    start=(0.0, -0.6, 0.0, -2.4, 0.0, 3.2, 0.785),
)
