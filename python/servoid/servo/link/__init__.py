"""Connects the loop to a real arm's driver over a socket, with commands that end at rest."""

from servoid.servo.link.lines import Address, listening
from servoid.servo.link.linked_arm import ArmModel, LinkedArm
from servoid.servo.link.messages import MotionCommand, Phase, Start, State, Welcome
from servoid.servo.link.receiver import CommandReceiver, Refusal
from servoid.servo.link.serving import DrivenJoints, DriverStep, serve_arm
from servoid.servo.link.settings import LinkSettings
from servoid.servo.link.stopping import StoppingTrajectory

__all__ = [
    "Address",
    "ArmModel",
    "CommandReceiver",
    "DrivenJoints",
    "DriverStep",
    "LinkSettings",
    "LinkedArm",
    "MotionCommand",
    "Phase",
    "Refusal",
    "Start",
    "State",
    "StoppingTrajectory",
    "Welcome",
    "listening",
    "serve_arm",
]
