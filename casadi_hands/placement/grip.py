"""How hard contacts must press to bear all loads, whatever disturbs them: a linear programme, and bounds on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import linprog

from casadi_hands.placement.loads import Contacts, Load
from casadi_hands.statics.grasp import EDGES

Array = NDArray[np.float64]
Index = NDArray[np.int64]
_AT_ONCE = 4096  # sets, for the memory that their bounds take
_SOFT = 1e-3  # lengths, of the springs that hard points twist by, which tell what nothing else bears
_NO_TWIST = 1e-4  # m·g·length, below which it is none
_MOST = 1e3  # m·g: what asks for more cannot be borne
_ANGLES = 2 * np.pi * (np.arange(EDGES) + 0.5) / EDGES
# Of the facets of the cone's octagon: the directions across, against which the normal force times friction stands.
_ACROSS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True)
class Grip:
    """The least that contacts must press.

    Attributes:
        most: m·g, of the hardest-pressed contact under the hardest load; inf where the loads cannot be borne.
        forces: (L, K, 3) of the contacts on the object for each load, undisturbed, object frame; none without.
        prices: (L, 6) of the loads' wrenches, which give bounds for other sets; none without.
    """

    most: float
    forces: Array
    prices: Array


def reactions(contacts: Contacts, sets: Index, disturbances: Array) -> Array:
    """(S, K, D, 4) forces and torsional moments in contact frames with which sets (S, K) meet disturbances (D, 6).

    Fingertips are springs, all alike; twisting, they are so soft that they bear only what nothing else can. No motor
    reacts.
    """
    soft = np.array([1.0, 1.0, 1.0, max(contacts.torsion, _SOFT) ** 2])
    maps = contacts.maps[sets]
    stiffness = np.einsum("skia,i,skib->sab", maps, soft, maps) + 1e-12 * np.eye(6)
    moved = np.linalg.solve(stiffness, np.broadcast_to(disturbances.T, (len(sets), 6, len(disturbances))))
    return np.asarray(np.einsum("i,skia,sad->skdi", soft, maps, moved))


def reserves(contacts: Contacts, sets: Index, disturbances: Array) -> tuple[Array, Array]:
    """What planned forces must leave for the worst disturbance.

    Returns:
        (S, K, EDGES) of each facet of the friction's octagons, and (S, K) of the torsion, m·g and m·g·length.
    """
    met = reactions(contacts, sets, disturbances)
    facets = (met[..., 1:3] @ _ACROSS.T - contacts.friction * met[..., :1]).max(axis=2)
    twists = (np.abs(met[..., 3]) - contacts.torsion * met[..., 0]).max(axis=2)
    return np.maximum(facets, 0.0), np.where(twists > _NO_TWIST, twists, 0.0)


def least_grip(contacts: Contacts, chosen: Index, loads: Sequence[Load], disturbances: Array) -> Grip:
    """The least that the hardest-pressed contact presses with over all loads, each borne as it is best.

    Args:
        contacts: the points.
        chosen: (K,) indices of those that touch.
        loads: that must be borne, with forces that are planned.
        disturbances: (D, 6) that come on top, and are met as by springs; none, of shape (0, 6), where none are.
    """
    count, first = len(chosen), chosen[None]
    facets, twists = np.zeros((count, EDGES)), np.zeros(count)
    if len(disturbances):
        facets, twists = (part[0] for part in reserves(contacts, first, disturbances))
    if max(facets.max(), twists.max()) > _MOST:
        return Grip(np.inf, np.zeros((0, count, 3)), np.zeros((0, 6)))
    # For each contact: its octagon, its torsion either way, its normal force below the grip.
    octagon = np.column_stack([np.full(EDGES, -contacts.friction), _ACROSS, np.zeros(EDGES)])
    twist = np.array([[-contacts.torsion, 0, 0, 1], [-contacts.torsion, 0, 0, -1]])
    rows = np.vstack([octagon, twist, [[1.0, 0, 0, 0]]])
    most = np.column_stack([-facets, -twists, -twists, np.zeros(count)]).reshape(-1)
    wrenches = np.hstack([each.T for each in contacts.maps[chosen]])
    grip = np.tile(np.append(np.zeros(len(rows) - 1), -1.0), count)[:, None]
    equal, below, bounds = [], [], []
    for load in loads:
        helps = load.ground.shape[1]
        equal.append(np.hstack([wrenches, load.ground]))
        ground = np.append(np.zeros(4 * count), np.ones(helps))[None]
        below.append(np.vstack([np.hstack([np.kron(np.eye(count), rows), np.zeros((len(most), helps))]), ground]))
        bounds += [(None, None)] * (4 * count) + [(0, None)] * helps
    columns = sum(block.shape[1] for block in equal)
    found = linprog(
        np.append(np.zeros(columns), 1.0),
        A_ub=np.hstack([block_diag(*below), np.tile(np.vstack([grip, [[0.0]]]), (len(loads), 1))]),
        b_ub=np.tile(np.append(most, 1.0), len(loads)),
        A_eq=np.hstack([block_diag(*equal), np.zeros((6 * len(loads), 1))]),
        b_eq=np.concatenate([load.wrench for load in loads]),
        bounds=[*bounds, (None, None)],
        method="highs",
    )
    if found.status != 0:
        return Grip(np.inf, np.zeros((0, count, 3)), np.zeros((0, 6)))
    starts = np.cumsum([0, *[block.shape[1] for block in equal[:-1]]])
    local = np.array([found.x[at : at + 4 * count].reshape(count, 4)[:, :3] for at in starts])
    forces = np.einsum("lki,kij->lkj", local, contacts.frames[chosen])
    return Grip(float(found.fun), forces, np.asarray(found.eqlin.marginals).reshape(-1, 6))


class Bounds:
    """Bounds from below on the grip of any sets of contacts.

    What opposite facets of a cone must leave for disturbances takes a normal force p of its own. And for prices y of
    wrenches, contacts that press with t at most make at most t·Σ h(y), h a contact's most for pressing with 1; one that
    makes less than nothing, −l(y), takes l·p at least. So the load w asks for (y·w − ground's most + Σ l·p) / Σ h.

    Args:
        contacts: the points.
        loads: what some of them must bear.
        disturbances: (D, 6) that come on top.
        rng: draws prices to begin with.
        count: how many.
    """

    def __init__(
        self, contacts: Contacts, loads: Sequence[Load], disturbances: Array, rng: np.random.Generator, count: int = 240
    ) -> None:
        self.contacts, self.loads, self.disturbances = contacts, tuple(loads), disturbances
        self.made, self.wanted = np.zeros((len(contacts.maps), 0)), np.zeros(0)
        wrenches = np.array([load.wrench for load in loads])
        self.add(np.vstack([np.eye(6), -np.eye(6), wrenches, rng.normal(size=(count, 6))]))

    def add(self, prices: Array) -> None:
        """Take more prices (M, 6) into account; those of nothing are left out."""
        prices = prices[np.linalg.norm(prices, axis=1) > 1e-9]
        if not len(prices):
            return
        prices = prices / np.linalg.norm(prices, axis=1, keepdims=True)
        wanted = np.full(len(prices), -np.inf)
        for load in self.loads:
            helped = np.maximum((prices @ load.ground).max(axis=1, initial=-np.inf), 0.0)
            wanted = np.maximum(wanted, prices @ load.wrench - helped)
        made = (prices @ self.contacts.edges).max(axis=2)
        self.made, self.wanted = np.hstack([self.made, made]), np.append(self.wanted, wanted)

    def of(self, sets: Index, pressed: Array, since: int = 0) -> Array:
        """The bound (S,) by prices for each set (S, K), m·g; inf where sets are seen to be unable.

        Args:
            sets: indices of contacts.
            pressed: (S, K) what each contact presses with at least.
            since: leave this many of the first prices out.
        """
        found, wanted = np.zeros(len(sets)), self.wanted[since:]
        most, lost = np.maximum(self.made[:, since:], 0.0), np.maximum(-self.made[:, since:], 0.0)
        if not len(wanted):
            return found
        for first in range(0, len(sets), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            takes = np.einsum("skp,sk->sp", lost[sets[some]], np.where(np.isfinite(pressed[some]), pressed[some], 0.0))
            asked = np.where(wanted + takes > 1e-9, wanted + takes, 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                each = np.where(asked > 0, asked / most[sets[some]].sum(axis=1), 0.0)
            found[some] = each.max(axis=1)
        return found

    def pressed(self, sets: Index) -> Array:
        """What each contact (S, K) presses with at least, for what it must leave; inf where that cannot be borne."""
        found = np.zeros(sets.shape)
        if not len(self.disturbances):
            return found
        for first in range(0, len(sets), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            facets, twists = reserves(self.contacts, sets[some], self.disturbances)
            pressed = (facets + np.roll(facets, EDGES // 2, axis=2)).max(axis=2) / (2 * self.contacts.friction)
            if self.contacts.torsion:
                pressed = np.maximum(pressed, twists / self.contacts.torsion)
            else:
                pressed = np.where(twists > 0, np.inf, pressed)
            found[some] = np.where(pressed > _MOST, np.inf, pressed)
        return found

    def all(self, sets: Index) -> Array:
        """The largest (S,) of all bounds."""
        pressed = self.pressed(sets)
        return np.asarray(np.maximum(self.of(sets, pressed), pressed.max(axis=1)))
