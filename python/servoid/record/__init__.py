"""Recording: estimates become files, and files trajectories."""

from servoid.record.looks import write_looks
from servoid.record.overlay import Overlay
from servoid.record.servo_log import Seen, ServoLog, ServoRow, off_center
from servoid.record.trajectory import (
    Waypoint,
    check_suffix,
    read_trajectory,
    waypoints,
    write_trajectory,
)
from servoid.record.video_file import check_video, overlay_video

__all__ = [
    "Overlay",
    "Seen",
    "ServoLog",
    "ServoRow",
    "Waypoint",
    "check_suffix",
    "check_video",
    "off_center",
    "overlay_video",
    "read_trajectory",
    "waypoints",
    "write_looks",
    "write_trajectory",
]
