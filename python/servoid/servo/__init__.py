"""Servoing: an arm that carries turning eyes is led to an object and kept there."""

from servoid.servo.arm import Arm, Eyes, Joints, JointState

__all__ = ["Arm", "Eyes", "JointState", "Joints"]
