"""What a kernel is bound to, by name: all of its symbols, and each to what it asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from casadi_hands.nlp.kernel import Kernel, Local
from casadi_hands.nlp.layout import Label, Parameter, Rows

Argument = Rows | Parameter


def arguments_by_name(kernel: Kernel, arguments: Mapping[str, Argument | Sequence[Argument]]) -> dict[str, Argument]:
    """One argument for each of a kernel's symbols; sequences are spread over ``name0``, ``name1``, ….

    Raises:
        TypeError: an argument that is missing or unknown.
    """
    given: dict[str, Argument] = {}
    for name, argument in arguments.items():
        if isinstance(argument, Rows | Parameter):
            given[name] = argument
        else:
            given |= {f"{name}{place}": each for place, each in enumerate(argument)}
    names = set(kernel.locals)
    for what, which in (("unknown", given.keys() - names), ("missing", names - given.keys())):
        if which:
            raise TypeError(
                f"{kernel.name}: {what}: {', '.join(sorted(which))}; its arguments are {', '.join(kernel.locals)}"
            )
    return given


def check_arguments(kernel: Kernel, given: Mapping[str, Argument]) -> None:
    """Refuse arguments of another kind, shape or quantity than their symbols, of different owners, or out of order.

    Raises:
        ValueError: there is one; the message names it.
    """
    if not kernel.local_variables:
        raise ValueError(f"{kernel.name}: has no variables, so nothing tells how often it is to be evaluated")
    first = given[kernel.local_variables[0].name]
    if not isinstance(first, Rows):
        raise ValueError(f"{kernel.name}.{kernel.local_variables[0].name}: a variable reads rows of variables")
    for local in kernel.local_variables:
        argument = given[local.name]
        if not isinstance(argument, Rows):
            raise ValueError(f"{kernel.name}.{local.name}: a variable reads rows of variables, not a parameter")
        _check(kernel.name, local, argument.label, (argument.count, argument.width), (first.count,))
    for local in kernel.local_parameters:
        argument = given[local.name]
        if not isinstance(argument, Parameter):
            raise ValueError(f"{kernel.name}.{local.name}: a parameter reads parameters, not rows of variables")
        _check(kernel.name, local, argument.label, argument.shape, (first.count, 1))
    _check_owners(kernel, given)
    _check_order(kernel, given)


def _check(kernel: str, local: Local, label: Label, shape: tuple[int, ...], counts: tuple[int, ...]) -> None:
    if shape not in [(count, local.size) for count in counts]:
        raise ValueError(f"{kernel}.{local.name}: rows {shape}, expected ({counts[0]}, {local.size})")
    if label.quantity != local.quantity:
        raise ValueError(f"{kernel}.{local.name}: given '{label.quantity}', expected '{local.quantity}'")


def _check_owners(kernel: Kernel, given: Mapping[str, Argument]) -> None:
    """At one place all belong to one owner."""
    owners: dict[int | None, tuple[str, int]] = {}
    for local in kernel.locals.values():
        owner = given[local.name].label.owner
        if owner is None:
            continue
        name, other = owners.setdefault(local.place, (local.name, owner))
        if owner != other:
            raise ValueError(f"{kernel.name}.{local.name}: is {owner}'s, and {name} is {other}'s")


def _check_order(kernel: Kernel, given: Mapping[str, Argument]) -> None:
    """Of several of one quantity, those at later places are later."""
    marks: dict[str, list[tuple[int, float, str]]] = {}
    for local in kernel.locals.values():
        when = given[local.name].label.when
        if local.place is not None and when is not None:
            marks.setdefault(local.quantity, []).append((local.place, when, local.name))
    for marked in marks.values():
        ordered = sorted(marked)
        for (_, before, first), (_, after, second) in pairwise(ordered):
            if after <= before:
                raise ValueError(f"{kernel.name}.{second}: is not later than {first}")
