"""A simulated world: an arm with moving cameras and an object, under physics."""

from servoid.sim.world.arms.file_arm import is_file_name
from servoid.sim.world.events.by_hand import hand_drawn, hand_missed
from servoid.sim.world.events.faults import DropImages, Fault, FreezeCamera, Occlude, Teleport
from servoid.sim.world.events.paths import KINDS, Path, Recorded, parse_path
from servoid.sim.world.lab_settings import IDEAL, LabSettings
from servoid.sim.world.live_world import open_world
from servoid.sim.world.objects import OBJECTS, make_object
from servoid.sim.world.scene.room import BACKGROUNDS, make_room
from servoid.sim.world.settings import (
    BEFORE_HAND,
    ArmSettings,
    CameraSettings,
    LightSettings,
    ObjectSettings,
    PhysicsSettings,
    WorldSettings,
)
from servoid.sim.world.world import World

__all__ = [
    "BACKGROUNDS",
    "BEFORE_HAND",
    "IDEAL",
    "KINDS",
    "OBJECTS",
    "ArmSettings",
    "CameraSettings",
    "DropImages",
    "Fault",
    "FreezeCamera",
    "LabSettings",
    "LightSettings",
    "ObjectSettings",
    "Occlude",
    "Path",
    "PhysicsSettings",
    "Recorded",
    "Teleport",
    "World",
    "WorldSettings",
    "hand_drawn",
    "hand_missed",
    "parse_path",
]
