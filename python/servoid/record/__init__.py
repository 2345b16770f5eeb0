"""Recording: writes images, videos and logs, and reads and writes trajectories."""

from servoid.record.answers import draw_answers
from servoid.record.capture_folder import FolderRecorder, check_recording, record_folder
from servoid.record.frozen import FrozenWatch
from servoid.record.live_video import live_video
from servoid.record.overlay import Overlay
from servoid.record.queued import QueuedRecording
from servoid.record.servo_log import write_servo_log, write_servo_times
from servoid.record.servo_overlay import ServoOverlay, ServoScene
from servoid.record.servo_video import ServoVideo
from servoid.record.trajectory import (
    Waypoint,
    check_suffix,
    read_trajectory,
    waypoints,
    write_trajectory,
)
from servoid.record.video_file import check_video, check_video_suffix, image_video, overlay_video

__all__ = [
    "FolderRecorder",
    "FrozenWatch",
    "Overlay",
    "QueuedRecording",
    "ServoOverlay",
    "ServoScene",
    "ServoVideo",
    "Waypoint",
    "check_recording",
    "check_suffix",
    "check_video",
    "check_video_suffix",
    "draw_answers",
    "image_video",
    "live_video",
    "overlay_video",
    "read_trajectory",
    "record_folder",
    "waypoints",
    "write_servo_log",
    "write_servo_times",
    "write_trajectory",
]
