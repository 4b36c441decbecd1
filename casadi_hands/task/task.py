"""The task: everything the user asks for, checked, with every default filled in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationInfo, field_validator

from casadi_hands.errors import TaskError
from casadi_hands.motion import nearest_exponential
from casadi_hands.task.fields import Positive, Section, Vector, Whole, fill, follows, refuse
from casadi_hands.task.finger import FingerSpec
from casadi_hands.task.given import Given, merged, plain
from casadi_hands.task.hand import (
    SHORTEST_LINK,
    Actuator,
    Fingertip,
    Ground,
    HandSpec,
    rubber_torsion,
    usual_hinge,
)
from casadi_hands.task.keep_out import KeepOut
from casadi_hands.task.limits import USUAL_DEFLECTION, Limits, usual_replay_position
from casadi_hands.task.material import hinge_loads
from casadi_hands.task.motion import Goal, Perturbation
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.on_joint import placed, resisting_force
from casadi_hands.task.palm import Palm
from casadi_hands.task.region import counted_fingers
from casadi_hands.task.rotation import middle_turn
from casadi_hands.task.search import Search
from casadi_hands.task.servos import servo_reach
from casadi_hands.task.thickness import usual_force, usual_link_radius
from casadi_hands.task.weights import Weights

STANDARD_GRAVITY = 9.81  # m/s²
USUAL_CLEARANCE = 0.02  # of the characteristic length


class Task(Section):
    """One task. Lengths in m, times in s, masses in kg; angles in degrees; world z is up."""

    name: str = Field(
        min_length=1, description="What the task is called.", json_schema_extra={"default": "the file's name"}
    )
    about: str = Field(default="", description="What it is about, in a sentence.")
    object: ManipulatedObject = Field(description="The object to move.")
    palm: Palm = Field(description="The palm and where it stands; `auto` lets the program choose that.")
    motion: tuple[Goal, ...] = Field(
        min_length=2, description="Goals that the object passes through, in order of time."
    )
    tool: Vector | None = Field(
        default=None, description="The point of the object that draws, m, object frame; drawing tasks only."
    )
    duration: Positive = Field(
        default_factory=follows(lambda data: max(goal.at for goal in data["motion"])),
        description="How long the motion takes, s.",
        json_schema_extra={"default": "the last goal's time"},
    )
    time_step: Annotated[Positive, Field(le=0.1)] = Field(
        default=0.1, description="Time between samples, s; at most 0.1."
    )
    keyframes_between: Annotated[Whole, Field(ge=1, le=3)] = Field(
        default=2, description="Keyframes between one goal and the next, 1 to 3."
    )
    fingers: Annotated[dict[str, FingerSpec], BeforeValidator(counted_fingers)] = Field(
        min_length=1,
        description="The fingers by name, one contact each. Or, for contacts that the program places, their number, "
        "`{count: [least, most]}`, or `auto`: 2 to 5.",
    )
    friction: Positive = Field(default=0.5, description="Coulomb friction of fingertips and object.")
    gravity: Vector = Field(default=(0.0, 0.0, -STANDARD_GRAVITY), description="Gravity, m/s², world.")
    ground: Ground | None = Field(
        default=None, description="The floor the object may rest on; `none` if there is none."
    )
    keep_out: tuple[KeepOut, ...] = Field(
        default=(), description="Boxes of the world that the palm, which then stands still, keeps off."
    )
    perturbations: tuple[Perturbation, ...] = Field(default=(), description="Disturbances that the grasp must stand.")
    hand: HandSpec = Field(default={}, validate_default=True, description="What fingers can be built.")
    fingertip: Fingertip = Field(default={}, validate_default=True, description="The tips of the fingers.")
    actuator: Actuator = Field(default={}, validate_default=True, description="The motors.")
    motors: Literal["independent", "fewest"] | Annotated[Whole, Field(ge=1)] = Field(
        default="independent",
        description="Motors of the hand: `independent`, one for every joint; `fewest`, as few as are found to turn all "
        "joints by fixed ratios; or their number. With servos in the joints, `independent`.",
    )
    limits: Limits = Field(default={}, validate_default=True, description="Limits of the certificate.")
    search: Search = Field(default=Search(), description="The search over structures.")
    weights: Weights = Field(default=Weights(), description="Weights of the soft stages' cost terms.")

    _given: Given = PrivateAttr(default_factory=Given)

    # Defaults that follow from other sections. Where such a section is itself wrong the task is refused anyway,
    # and any valid number will do to let the rest of this section be checked.

    @field_validator("motion")
    @classmethod
    def _on_joint(cls, value: tuple[Goal, ...], info: ValidationInfo) -> tuple[Goal, ...]:
        return placed(value, info.data.get("object"))

    @field_validator("palm", mode="before")
    @classmethod
    def _palm_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        body = info.data.get("object")
        value = {"auto": True} if value == "auto" else value
        return fill(value, radius=1.2 * body.characteristic_length if body else 1.0)

    @field_validator("fingers")
    @classmethod
    def _finger_names(cls, value: dict[str, FingerSpec]) -> dict[str, FingerSpec]:
        for name in value:
            if name == "ground" or not name.replace("_", "").replace("-", "").isalnum():
                raise refuse(f"names of letters, digits, _ and -, and not 'ground'; {name!r} is not")
        return value

    @field_validator("ground", mode="before")
    @classmethod
    def _ground_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        if value == "none":
            return None
        body, goals = info.data.get("object"), info.data.get("motion")
        lowest = tuple(map(float, body.lowest_point(goals[0].rotation.matrix))) if body and goals else (0.0, 0.0, 0.0)
        return fill(value, friction=info.data.get("friction", 1.0), touches=lowest)

    @field_validator("hand", mode="before")
    @classmethod
    def _hand_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        body, palm, fingers, goals = (info.data.get(name) for name in ("object", "palm", "fingers", "motion"))
        clearance = USUAL_CLEARANCE * body.characteristic_length if body else 1.0
        value = fill(value, clearance=clearance)
        if not isinstance(value, dict):
            return value
        usual, reach = 1.0, None
        if palm and body and fingers and goals:
            touched = [finger.point for finger in fingers.values() if finger.is_placed]
            points = [point for finger in fingers.values() if finger.is_placed for point in finger.points]
            points += [] if len(touched) == len(fingers) else body.extremes
            reach = palm.radius + _farthest_contact(palm, points, goals, info.data.get("tool"))
            gravity = float(np.linalg.norm(info.data.get("gravity", 0.0))) or STANDARD_GRAVITY
            force = usual_force(body.mass * gravity, info.data.get("friction", 1.0), reach)
            length, material = body.characteristic_length, value.get("material")
            usual = usual_link_radius(palm.radius, length, force, reach, material, touched)
        value = fill(value, link_radius=usual)
        radius = value["link_radius"]
        plain = isinstance(radius, float | int)
        if "link_length" in value:
            return fill(value, hinge_length=usual_hinge(radius, value["link_length"]) if plain else 0.0)
        length = (1.0, 1.0)
        if reach is not None and plain:
            shortest = max(SHORTEST_LINK * radius, 2.0 * servo_reach(value.get("drive")))
            length = (shortest, max(shortest, reach))
        return fill({**value, "link_length": length}, hinge_length=usual_hinge(radius, length) if plain else 0.0)

    @field_validator("actuator", mode="before")
    @classmethod
    def _actuator_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        hand = info.data.get("hand")
        servo = hand.drive.motor if hand else None
        if servo is None:
            return value
        stiffness = {} if servo.stiffness is None else {"stiffness": servo.stiffness}
        return fill(value, torque=servo.continuous, speed=servo.speed, **stiffness)

    @field_validator("motors", mode="before")
    @classmethod
    def _motors(cls, value: Any, info: ValidationInfo) -> Any:
        if value not in ("independent", "fewest") and not (type(value) is int and value >= 1):
            raise refuse("independent, fewest, or a whole number of at least 1")
        hand = info.data.get("hand")
        if value != "independent" and hand and hand.drive.motor:
            raise refuse("independent with hand.drive.servo: servos in every joint are motors of their own")
        return value

    @field_validator("fingertip", mode="before")
    @classmethod
    def _fingertip_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        hand, friction = info.data.get("hand"), info.data.get("friction", 1.0)
        value = fill(value, radius=hand.link_radius if hand else 1.0)
        radius = value.get("radius") if isinstance(value, dict) else None
        return fill(value, torsion=rubber_torsion(friction, radius) if isinstance(radius, float | int) else 0.0)

    @field_validator("limits", mode="before")
    @classmethod
    def _limits_defaults(cls, value: Any, info: ValidationInfo) -> Any:
        body, hand = info.data.get("object"), info.data.get("hand")
        motor = info.data.get("actuator") or Actuator()
        length = body.characteristic_length if body else 1.0
        usual = {"replay_position": usual_replay_position(length), "tip_deflection": USUAL_DEFLECTION * length}
        if hand:
            usual["link_stress"] = hand.material.strength / hand.safety_factor
            force, moment = hinge_loads(hand.material, hand.safety_factor, hand.link_radius)
            usual |= {"bearing_force": force, "bearing_moment": moment}
        return fill(value, least_stiffness=motor.stiffness, **usual)

    def changed(self, **changes: Any) -> Task:
        """The task with some fields changed, checked as a file is that has them so; defaults follow anew.

        Args:
            changes: new values by field, as a file would give them. In mappings, what is not named stays as it is:
                ``changed(hand={"bend": 0}, friction=0.4)``. None gives a field its default back.

        Raises:
            TaskError: the fields make no task; a line for each thing that is wrong. Or the task is not of `load_task`.
        """
        if self._given.make is None:
            raise TaskError(
                "a task can be changed that load_task gave; this one was made of sections: give load_task a mapping"
            )
        data = self._given.data
        if data is None:
            data = plain(self.model_dump(by_alias=True, exclude_none=True))
        changed: Task = self._given.make(merged(data, plain(changes)))
        return changed

    def was_given(self, given: Given) -> None:
        """Remember what the task was made of."""
        self._given = given

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, which are not checked; `changed` checks them."""
        copy = super().model_copy(update=update, deep=deep)
        if update:
            fields = copy.model_dump(by_alias=True, exclude_none=True, include=set(update))
            copy.was_given(self._given.updated(plain(fields)))
        return copy

    @property
    def draws(self) -> bool:
        """Whether goals are points of the tool rather than poses of the object."""
        return self.tool is not None

    @property
    def is_placed(self) -> bool:
        """Whether every finger has a point to touch; else `solve` places contacts first."""
        return all(finger.is_placed for finger in self.fingers.values())

    @property
    def force_unit(self) -> float:
        """The unit of force, N, called a weight: the object's; with gravity off, what it would be at 9.81 m/s².

        Where more resists the object, its joint or the world that it presses on, as much as that.
        """
        weight = self.object.mass * (float(np.linalg.norm(self.gravity)) or STANDARD_GRAVITY)
        return max(weight, resisting_force(self.object, self.motion, self.goal_turns()))

    def goal_poses(self) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
        """Time (s), position (3,) (m, world) and rotation vector (3,) (rad) of the object at every goal.

        A drawing goal leaves the pose open; it is given with the object upright and the tool at its point.
        """
        return _poses(self.motion, self.tool)

    def goal_turns(self) -> np.ndarray:
        """Rotation vectors (G, 3), rad, world, of the object at every goal from its orientation at the first one.

        Turns about the first goal's axis are as far as stated; others continue the turn to the goal before.
        """
        stated = np.array([goal.rotation.vector for goal in self.motion])
        first = self.motion[0].rotation.matrix
        turns = [np.zeros(3)]
        for goal, vector in zip(self.motion[1:], stated[1:], strict=True):
            parallel = np.linalg.norm(np.cross(stated[0], vector)) < 1e-9
            turns.append(
                nearest_exponential(goal.rotation.matrix @ first.T, vector - stated[0] if parallel else turns[-1])
            )
        return np.array(turns)

    @property
    def middle_turn(self) -> np.ndarray:
        """Rotation vector (3,), rad, world, from the first goal's orientation to the one that turns are counted from.

        That orientation itself; where a free object turns far about one axis, the middle of all turns.
        """
        return np.zeros(3) if self.object.attached is not None else middle_turn(self.goal_turns())


def _poses(goals: tuple[Goal, ...], tool: Vector | None) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
    def position(goal: Goal) -> np.ndarray:
        if goal.tool_at is not None:
            start: np.ndarray = np.array(goal.tool_at) - np.array(tool or (0.0, 0.0, 0.0))
            return start
        return np.array(goal.position, dtype=float)

    return tuple((goal.at, position(goal), goal.rotation.vector) for goal in goals)


def _farthest_contact(palm: Palm, touched: Sequence[ArrayLike], goals: tuple[Goal, ...], tool: Vector | None) -> float:
    """Largest distance over goals and points (object frame) of one and the nearest place the palm passes through, m."""
    centers = np.array([position for _, position, _ in palm.waypoints])
    contacts = np.array(touched)
    farthest = 0.0
    for goal, (_, position, _) in zip(goals, _poses(goals, tool), strict=True):
        world = position + contacts @ goal.rotation.matrix.T
        farthest = max(farthest, min(float(np.linalg.norm(world - center, axis=1).max()) for center in centers))
    return farthest
