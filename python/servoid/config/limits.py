"""How much servoid takes in: what is more is refused before it is read, made or started."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FileLimit:
    """How many bytes a kind of file may have; `what` names the kind, of one file or of many."""

    what: str
    most_bytes: int

    @property
    def text(self) -> str:
        """Write the limit as people read it, such as `16 MiB`."""
        mebibytes = self.most_bytes >> 20
        return f"{mebibytes >> 10} GiB" if mebibytes >= 1024 else f"{mebibytes} MiB"


_MIB = 1 << 20

IMAGE_FILE = FileLimit("images, masks and depth images", 512 * _MIB)
BAG_MESSAGE = FileLimit("messages of bags", 512 * _MIB)
STREAM_IMAGE = FileLimit("images of a stream over HTTP", 64 * _MIB)
SETTINGS_FILE = FileLimit("capture.toml and other TOML files", 4 * _MIB)
BODY_FILE = FileLimit("bodies", 32 * _MIB)
POSES_FILE = FileLimit("poses.csv and other trajectories", 256 * _MIB)
SCENE_FILE = FileLimit("transforms.json and the files of BOP scenes", 256 * _MIB)
COLMAP_FILE = FileLimit("the files of COLMAP models", 1024 * _MIB)
SHAPE_FILE = FileLimit("meshes and point clouds", 1024 * _MIB)
ARM_FILE = FileLimit("files of arms", 64 * _MIB)
TRIAL_FILE = FileLimit("the trials of a study", 64 * _MIB)

FILE_LIMITS = (
    IMAGE_FILE,
    BAG_MESSAGE,
    STREAM_IMAGE,
    SETTINGS_FILE,
    BODY_FILE,
    POSES_FILE,
    SCENE_FILE,
    COLMAP_FILE,
    SHAPE_FILE,
    ARM_FILE,
    TRIAL_FILE,
)

MOST_VIEW_PX = 160_000_000
"""How many pixels the views that are modelled may have together; more are shrunk as they are read:
at four bytes a pixel, with its mask, and twice for a moment, well within a gibibyte and a half."""

MOST_CAMERAS = 64
"""How many cameras a capture.toml or a rig's file may name."""

MOST_TRANSFORMS = 4_000_000
"""How many transforms of a bag are kept: a quarter of a gibibyte."""

MOST_KEYS = 120
"""How many images a scan chooses of a video."""

MOST_NESTED = 32
"""How many tables and lists of TOML and JSON may lie inside each other."""
