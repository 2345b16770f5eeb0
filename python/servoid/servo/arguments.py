"""Checks what a program passes to a controller: an arm, joint states, estimates and goals."""

from dataclasses import dataclass, fields

import numpy as np

from servoid.config import NEAR_M, PERIOD_S, implausible
from servoid.errors import ServoError
from servoid.pose import Floats, Pose, exact
from servoid.servo.arm import Arm, Eyes, Joints, JointState
from servoid.servo.belief.target import TargetEstimate
from servoid.servo.rows import is_index, is_number
from servoid.servo.settings import ServoSettings
from servoid.words import counted

_STATUSES = ("tracking", "searching", "lost")
_NEEDED = ("joints", "eyes", "period_s", "state", "world_from_hand", "jacobian")  # of an arm
_ROUNDING = 1e-6  # of a probability beyond 0 or 1
_INDEFINITE = 1e-3  # share of it by which the variance of a direction may be, as of rounding
_NEGATIVE = 1e-9  # share of the greatest variance by which another may be below 0


@dataclass(frozen=True, eq=False)
class _Converted:
    """An estimate whose arrays are of float64."""

    time_s: float
    world_from_object: Pose
    confidence: float
    status: str
    located: bool
    covariance: Floats
    unobservable: Floats


_LISTED = tuple(field.name for field in fields(_Converted))


def check_arm(arm: Arm, settings: ServoSettings | None) -> None:
    """Check that an arm has what a controller needs, and that settings are settings.

    Raises:
        ServoError: they do not.

    """
    lacking = [name for name in _NEEDED if not hasattr(arm, name)]
    if lacking:
        raise ServoError(
            f"an arm needs {', '.join(_NEEDED)}, as servoid.servo.Arm describes them, but "
            f"{_kind(arm)} has no {', '.join(lacking)}"
        )
    if not isinstance(arm.joints, Joints):
        raise ServoError(f"Arm.joints must be servoid.servo.Joints, but is {_kind(arm.joints)}")
    if not is_number(arm.period_s) or not 0.0 < arm.period_s < np.inf:
        raise ServoError(f"Arm.period_s must be a number above 0, but is {arm.period_s!r:.60}")
    absurd = implausible("Arm.period_s", float(arm.period_s), PERIOD_S, "s")
    if absurd is not None:
        raise ServoError(absurd)
    if arm.eyes is not None:
        _check_eyes(arm.eyes, arm.joints)
    if not isinstance(settings, ServoSettings | None):
        raise ServoError(
            f"settings must be servoid.servo.ServoSettings or None, but are {_kind(settings)}"
        )


def _check_eyes(eyes: Eyes, joints: Joints) -> None:
    """Check that cameras have joints of their own, and a place on the hand that can be true."""
    if any(not hasattr(eyes, one.name) for one in fields(Eyes)):
        raise ServoError(f"Arm.eyes must be servoid.servo.Eyes or None, but is {_kind(eyes)}")
    first, count = joints.hand_count, len(joints.names)
    places = {name: getattr(eyes, name) for name in ("tilt", "pan_left", "pan_right")}
    for name, place in places.items():
        if not is_index(place) or not first <= place < count:
            raise ServoError(
                f"Arm.eyes.{name} is {place!r:.60}, but must be the index of a camera's joint, "
                + (
                    f"{first} to {count - 1}: the first {first} joints move the hand"
                    if first < count
                    else f"and all {count} joints move the hand: Joints.hand_count counts those"
                )
            )
    if len(set(places.values())) < len(places):
        given = ", ".join(f"{name} {place}" for name, place in places.items())
        raise ServoError(f"Arm.eyes uses a joint twice: {given}; give each its own index")
    if not is_number(eyes.half_baseline) or not eyes.half_baseline >= 0.0:
        raise ServoError(
            f"Arm.eyes.half_baseline must be 0 m or more, but is {eyes.half_baseline!r:.60}"
        )
    check_pose("Arm.eyes.hand_from_head", eyes.hand_from_head)
    offset = exact.norm(np.array(eyes.hand_from_head.translation))
    for name, length in (("hand_from_head", offset), ("half_baseline", eyes.half_baseline)):
        absurd = implausible(f"Arm.eyes.{name}", length, NEAR_M)
        if absurd is not None:
            raise ServoError(absurd)


def check_state(state: JointState, joints: Joints) -> None:
    """Check that a state has an angle and a speed for each joint.

    Raises:
        ServoError: it has not, or is something else.

    """
    if not isinstance(state, JointState):
        raise ServoError(f"state must be a servoid.servo.JointState, but is {_kind(state)}")
    count = len(joints.names)
    for name, row in (("positions", state.positions), ("velocities", state.velocities)):
        if row.shape != (count,):
            raise ServoError(
                f"JointState.{name} has {counted(len(row), 'number')}, but the arm has "
                f"{counted(count, 'joint')}: give one for each of {', '.join(joints.names)}"
            )


def check_jacobian(jacobian: Floats, joints: Joints) -> None:
    """Check that a Jacobian has a column for each joint.

    Raises:
        ServoError: it has another shape.

    """
    shape, needed = np.shape(jacobian), (6, len(joints.names))
    if shape != needed:
        raise ServoError(f"Arm.jacobian must return an array {needed}, but its shape is {shape}")


def check_returned(what: str, given: object) -> None:
    """Check that a method of an arm has returned a pose.

    Raises:
        ServoError: it has returned something else.

    """
    if not isinstance(given, Pose):
        raise ServoError(
            f"{what} must return a servoid.pose.Pose, but returned {_kind(given)}; "
            "make one of a matrix (4, 4) by Pose(matrix)"
        )


def check_pose(what: str, given: object) -> None:
    """Check that a goal is a pose.

    Raises:
        ServoError: it is something else.

    """
    if not _is_pose(given):
        raise ServoError(
            f"{what} must be a servoid.pose.Pose, but is {_kind(given)}; "
            "make one of a matrix (4, 4) by Pose(matrix)"
        )


def checked_estimate(estimate: TargetEstimate) -> TargetEstimate:
    """Check that an estimate has all its members, of the right kinds and shapes; return it.

    Numbers that are not finite pass: they hold the hand. Arrays of other numbers than float64 are
    converted.

    Raises:
        ServoError: a member is missing or wrong.

    """
    lacking = [name for name in _LISTED if not hasattr(estimate, name)]
    if lacking:
        raise ServoError(
            f"an estimate needs {', '.join(_LISTED)}, but {_kind(estimate)} has no "
            f"{', '.join(lacking)}"
        )
    check_pose("an estimate's world_from_object", estimate.world_from_object)
    for name in ("time_s", "confidence"):
        if not is_number(getattr(estimate, name)):
            given = getattr(estimate, name)
            raise ServoError(f"an estimate's {name} must be a number, but is {given!r:.60}")
    _check_confidence(float(estimate.confidence))
    if estimate.status not in _STATUSES:
        raise ServoError(
            f"an estimate's status must be one of {', '.join(_STATUSES)}, but is "
            f"{estimate.status!r:.60}"
        )
    covariance = _checked_covariance(estimate.covariance)
    if not _is_array(estimate.unobservable) or estimate.unobservable.shape[1:] != (6,):
        raise ServoError(
            "an estimate's unobservable must be an array (n, 6), with n = 0 if the images "
            f"observe all motions, but is {_kind(estimate.unobservable)}"
        )
    unobservable = np.asarray(estimate.unobservable, np.float64)
    if covariance is estimate.covariance and unobservable is estimate.unobservable:
        return estimate
    return _Converted(
        time_s=estimate.time_s,
        world_from_object=estimate.world_from_object,
        confidence=estimate.confidence,
        status=estimate.status,
        located=estimate.located,
        covariance=covariance,
        unobservable=unobservable,
    )


def _check_confidence(confidence: float) -> None:
    if not np.isfinite(confidence) or -_ROUNDING <= confidence <= 1.0 + _ROUNDING:
        return
    remedy = ": divide percentages by 100" if confidence > 1.0 else ""
    raise ServoError(
        f"an estimate's confidence is {confidence:g}; it is a probability, 0 to 1{remedy}"
    )


def _checked_covariance(covariance: Floats) -> Floats:
    """Check a covariance, and return it in float64."""
    if not _is_array(covariance) or covariance.shape != (6, 6):
        raise ServoError(
            "an estimate's covariance must be an array (6, 6), of (linear, angular), "
            f"but is {_kind(covariance)}"
        )
    variances = covariance.diagonal()
    if variances.min() < -_NEGATIVE * np.abs(variances).max():
        raise ServoError(
            "an estimate's covariance must have no variance below 0 on its diagonal, but has "
            f"{variances.min():g}"
        )
    numbers = np.asarray(covariance, np.float64)
    if not exact.is_finite(numbers):
        return numbers
    least = float(exact.eigh(0.5 * (numbers + numbers.T))[0][0])
    if least < -_INDEFINITE * variances.max():
        raise ServoError(
            "an estimate's covariance must have no direction of a variance below 0, but its least "
            f"eigenvalue is {least:.3g}; is it a product of standard deviations and correlations "
            "between -1 and 1?"
        )
    return numbers


def _is_array(given: object) -> bool:
    return isinstance(given, np.ndarray) and given.dtype.kind in "fiu"


def _is_pose(given: object) -> bool:
    return isinstance(given, Pose) or callable(getattr(given, "matrix", None))


def _kind(given: object) -> str:
    """Describe a value by its type, and by its shape if it is an array."""
    shape = f" of shape {given.shape}" if isinstance(given, np.ndarray) else ""
    return f"{type(given).__name__}{shape}"
