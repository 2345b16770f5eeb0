"""Limits on inputs: larger ones are refused before they are read, created or started."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FileLimit:
    """The largest size of a kind of file in bytes.

    Messages name the kind by `what`, and by `wanted` a file of it that a user could give. Files of
    it that are in the same folder as one that is missing are named, too, if `suffixes` are given.
    """

    what: str
    most_bytes: int
    wanted: str = "the file as its program writes it"
    suffixes: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """Format the limit for messages, such as `16 MiB`."""
        mebibytes = self.most_bytes >> 20
        return f"{mebibytes >> 10} GiB" if mebibytes >= 1024 else f"{mebibytes} MiB"


_MIB = 1 << 20

IMAGE_FILE = FileLimit("images, masks and depth images", 512 * _MIB)
BAG_MESSAGE = FileLimit("messages of bags", 512 * _MIB)
STREAM_IMAGE = FileLimit("images of a stream over HTTP", 64 * _MIB)
SETTINGS_FILE = FileLimit("capture.toml and other TOML files", 4 * _MIB)
CALIBRATION_FILE = FileLimit(
    "calibrations by other programs",
    1 * _MIB,
    "the calibration as its program writes it",
    suffixes=(".yaml", ".yml", ".json"),
)
BODY_FILE = FileLimit(
    "bodies", 32 * _MIB, "a body, such as servoid model --out writes", suffixes=(".json",)
)
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
    CALIBRATION_FILE,
    BODY_FILE,
    POSES_FILE,
    SCENE_FILE,
    COLMAP_FILE,
    SHAPE_FILE,
    ARM_FILE,
    TRIAL_FILE,
)

MOST_VIEW_PX = 160_000_000
"""The maximum number of pixels of all views in modelling; more are shrunk as they are read. At four
bytes a pixel with its mask, and twice that for a moment, they take well under 1.5 GiB."""

MOST_CAMERAS = 64
"""The maximum number of cameras in a capture.toml or a rig's file."""

MOST_TRANSFORMS = 4_000_000
"""The maximum number of transforms that are kept of a bag: 256 MiB."""

MOST_KEYS = 120
"""The maximum number of images that a scan chooses from a video."""

MOST_NESTED = 32
"""The maximum nesting depth of tables and lists in TOML, JSON and YAML."""
