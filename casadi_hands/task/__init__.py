"""What the user asks for: the task file's schema, its reader, its writer."""

from casadi_hands.task.finger import FingerSpec
from casadi_hands.task.hand import Actuator, Fingertip, Ground, HandSpec
from casadi_hands.task.limits import Limits
from casadi_hands.task.loader import load_task, parse_task
from casadi_hands.task.motion import Goal, Perturbation
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.palm import Palm, Waypoint
from casadi_hands.task.reference import describe_fields
from casadi_hands.task.rotation import Rotation
from casadi_hands.task.search import Search
from casadi_hands.task.shapes import Capsule, Sphere
from casadi_hands.task.task import Task
from casadi_hands.task.weights import Weights
from casadi_hands.task.writer import task_to_yaml

__all__ = [
    "Actuator",
    "Capsule",
    "FingerSpec",
    "Fingertip",
    "Goal",
    "Ground",
    "HandSpec",
    "Limits",
    "ManipulatedObject",
    "Palm",
    "Perturbation",
    "Rotation",
    "Search",
    "Sphere",
    "Task",
    "Waypoint",
    "Weights",
    "describe_fields",
    "load_task",
    "parse_task",
    "task_to_yaml",
]
