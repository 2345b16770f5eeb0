"""Visual servoing: controls an arm with moving cameras relative to a target object."""

from typing import TYPE_CHECKING

from servoid._native import change_between
from servoid.renamed import refuse_old_names
from servoid.servo.accuracy import Accuracy, TrueGoal, spun_like
from servoid.servo.arm import Arm, Clearances, Eyes, Joints, JointState, Solid
from servoid.servo.belief.remembering import RememberingArm
from servoid.servo.belief.target import TargetEstimate, TargetFilter
from servoid.servo.controller import Command, Controller
from servoid.servo.exploration import Exploration, Masks, awaited, explore
from servoid.servo.goal_times import GoalTimes, LimitingKind, limited_s, main_limit
from servoid.servo.keeping.safety import DOUBTING, ORDINARY, Reason
from servoid.servo.law.gaze import fixation
from servoid.servo.law.paper_law import PAPER_LAW, as_the_paper
from servoid.servo.law.reach import reached
from servoid.servo.log import Seen, ServoLog, ServoRow, off_center
from servoid.servo.loop import Goal, Tick, brought_to_rest, halt, servo, servo_tracked
from servoid.servo.metrics import Hold, ServoMetrics, Spread, holds
from servoid.servo.next_best_view import Viewpoint, VisitStep, next_viewpoint, visit
from servoid.servo.perception import Perception, TrackedInstant, TrackingInTurn, TrackingThread
from servoid.servo.settings import (
    GazeMode,
    JointLaw,
    LookSettings,
    ServoSettings,
    read_settings,
    settings_from,
)
from servoid.servo.settings_text import described, settings_toml
from servoid.servo.surface import body_places
from servoid.servo.verdict import ServoVerdict, verdict_of, why_errors_unknown

__all__ = [
    "DOUBTING",
    "ORDINARY",
    "PAPER_LAW",
    "Accuracy",
    "Arm",
    "Clearances",
    "Command",
    "Controller",
    "Exploration",
    "Eyes",
    "GazeMode",
    "Goal",
    "GoalTimes",
    "Hold",
    "JointLaw",
    "JointState",
    "Joints",
    "LimitingKind",
    "LookSettings",
    "Perception",
    "Reason",
    "RememberingArm",
    "Seen",
    "ServoLog",
    "ServoMetrics",
    "ServoRow",
    "ServoSettings",
    "ServoVerdict",
    "Solid",
    "Spread",
    "TargetEstimate",
    "TargetFilter",
    "Tick",
    "TrackedInstant",
    "TrackingInTurn",
    "TrackingThread",
    "TrueGoal",
    "Viewpoint",
    "VisitStep",
    "as_the_paper",
    "body_places",
    "brought_to_rest",
    "explore",
    "halt",
    "holds",
    "limited_s",
    "main_limit",
    "next_viewpoint",
    "off_center",
    "reached",
    "read_settings",
    "servo",
    "servo_tracked",
    "settings_from",
    "settings_toml",
    "spun_like",
    "verdict_of",
    "visit",
    "why_errors_unknown",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(
        __name__, {"Meeting": "Exploration", "Wish": "TrueGoal", "meet": "explore"}
    )
