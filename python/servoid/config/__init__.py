"""Files within limits, and settings checked as they are read or made; internal to servoid."""

from servoid.config.checked import Checked
from servoid.config.limits import (
    ARM_FILE,
    BAG_MESSAGE,
    BODY_FILE,
    CALIBRATION_FILE,
    COLMAP_FILE,
    IMAGE_FILE,
    MOST_CAMERAS,
    MOST_KEYS,
    MOST_TRANSFORMS,
    MOST_VIEW_PX,
    POSES_FILE,
    SCENE_FILE,
    SETTINGS_FILE,
    SHAPE_FILE,
    STREAM_IMAGE,
    TRIAL_FILE,
)
from servoid.config.places import (
    beside,
    check_held,
    check_inside,
    exists,
    first_file,
    followed,
    is_file,
    is_folder,
    is_same,
    name_fault,
    path_of,
)
from servoid.config.plausible import (
    BRAKING,
    FAR_M,
    HAND_SPEED,
    MODELLED_AWAY_M,
    MODELLED_SIZE_M,
    NEAR_M,
    OBJECT_MOST_M,
    OBJECT_SPEED,
    PERIOD_S,
    REACH_M,
    SENSED_AWAY_M,
    SENSED_SIZE_M,
    SQUARE_M,
    TURN,
    TURN_SPEED,
    WORLD_M,
    Most,
    distance_fault,
    implausible,
    size_note,
)
from servoid.config.reading import (
    check_regular,
    missing,
    read_bytes,
    read_json,
    read_text,
    read_toml_text,
    unreadable,
)
from servoid.config.strict import check_version, convert, line_of, read_toml
from servoid.config.yaml_reading import read_yaml
