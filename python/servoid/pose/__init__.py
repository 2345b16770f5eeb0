"""Rigid motions: `Pose` is an element of SE(3), named `a_from_b`."""

from servoid._native import Pose
from servoid.errors import PoseError
from servoid.pose import exact
from servoid.pose.exact import Floats
from servoid.pose.looking import CV_FROM_GL, looking
from servoid.pose.parts import joined, parts_of
from servoid.pose.robust_fit import RobustFit, robust_fit

__all__ = ["Pose", "PoseError", "looking"]
