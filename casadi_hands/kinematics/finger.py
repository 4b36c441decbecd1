"""The kinematics of one serial finger, computed by Pinocchio on CasADi symbols in a compiled extension."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import TypeVar

import casadi

from casadi_hands.errors import KinematicsError

Length = TypeVar("Length")
STAND = 1.05
"""Height of a finger's first joint above the palm's face, in its link's radii: the joint's ball turns clear of it."""


def link_radii(joints: int, radius: Length, tip: Length) -> list[Length]:
    """Radii of a finger's links, from the palm outwards: the last, which touches the object, has the fingertip's."""
    return [*[radius] * (joints - 1), tip]


@lru_cache
def finger_kinematics(joints: int) -> casadi.Function:
    """Build the kinematics of a serial finger with its morphology as symbols.

    Joint 0 sits at ``base``, joint j + 1 at ``(0, 0, lengths[j])`` in link j's frame, the tip at
    ``(0, 0, lengths[-1])`` in the last. At zero angle a link's frame is its parent's (the palm's for link 0), turned
    by its own entry of ``turns``. Any unit of length may go in, in place of the m below; the same comes out.

    The function is an SX function named ``finger_kinematics_{joints}``; called with SX it expands in place.

    Inputs:
        base: (3,) origin of joint 0, palm frame, m.
        turns: (3, 3n) the rotation of each link's frame at zero angle side by side, parent <- link.
        axes: (3, n) unit axis of each joint, in its link's frame. They are not normalised here: only for unit axes are
            the rotations rotations.
        lengths: (n,) segment lengths, m.
        angles: (n,) joint angles, rad.
        point: (3,) contact point in the last link's frame, m.

    Outputs:
        origins: (3, n) joint origins, palm frame, m.
        rotations: (3, 3n) the rotation of each link side by side, palm <- link.
        tip: (3,) end of the last segment, palm frame, m.
        contact: (3,) the contact point, palm frame, m.
        jacobian: (3, n) velocity of the contact point for unit joint rates, palm frame, m/rad.

    Args:
        joints: number of joints n, at least 1.

    Returns:
        The function; built once a process for each number of joints.

    Raises:
        ValueError: when there is no joint.
        KinematicsError: when the extension is missing or was compiled against another CasADi.
    """
    if joints < 1:
        raise ValueError(f"a finger has at least one joint, not {joints}")
    return casadi.Function.deserialize(_serialised(joints))


def _serialised(joints: int) -> str:
    # Another libcasadi may have other memory layouts and crash, so the versions are compared before it is touched.
    # Importing casadi above is what puts libcasadi in the process: the extension has no search path of its own.
    try:
        built_with: str = import_module("casadi_hands.kinematics._built_with").CASADI_VERSION
    except ImportError as error:
        raise KinematicsError(
            "the compiled kinematics extension is missing: install casadi-hands with pip, from its source folder: "
            "pip install ."
        ) from error
    loaded = casadi.CasadiMeta.version()
    if loaded != built_with:
        raise KinematicsError(
            f"the kinematics extension was built against casadi {built_with} but casadi {loaded} is loaded: "
            f"go back with pip install casadi=={built_with}, or build the extension for the newest casadi with "
            "pip install . in the source folder of casadi-hands"
        )
    try:
        extension = import_module("casadi_hands.kinematics._extension")
    except ImportError as error:
        raise KinematicsError(
            f"the compiled kinematics extension does not load: {error}; build it anew with pip install . in the source "
            "folder of casadi-hands"
        ) from error
    serialised: str = extension.finger_kinematics(joints)
    return serialised
