"""What IPOPT returns, by name: what each status means, and what is made of it."""

from __future__ import annotations

from typing import Literal, NamedTuple

Kind = Literal["solved", "stopped", "stuck", "broken", "interrupted"]


class Status(NamedTuple):
    """A return status.

    Attributes:
        kind: ``solved``: within tolerances. ``stopped``: at a limit, where it was. ``stuck``: no way on was found; its
            last values are a solution as any, judged by what they violate. ``broken``: there is nothing to judge.
            ``interrupted``: somebody stopped the program.
        words: what happened; continues ``IPOPT ...``.
    """

    kind: Kind
    words: str


STATUSES: dict[str, Status] = {
    "Solve_Succeeded": Status("solved", "found an optimum"),
    "Solved_To_Acceptable_Level": Status("solved", "found an optimum within its wider tolerances"),
    "Feasible_Point_Found": Status("solved", "found values that meet all constraints, with nothing to optimise"),
    "Maximum_Iterations_Exceeded": Status("stopped", "had taken all iterations that it is given"),
    "Maximum_CpuTime_Exceeded": Status("stopped", "had taken all the time that it is given"),
    "Maximum_WallTime_Exceeded": Status("stopped", "had taken all the time that it is given"),
    "User_Requested_Stop": Status("stopped", "was stopped, as constraints contradict each other"),
    "Infeasible_Problem_Detected": Status("stuck", "found that constraints contradict each other near where it was"),
    "Restoration_Failed": Status("stuck", "found no way to violate constraints less"),
    "Search_Direction_Becomes_Too_Small": Status("stuck", "could not get on by steps that numbers can tell apart"),
    "Diverging_Iterates": Status("stuck", "went to ever larger values"),
    "Error_In_Step_Computation": Status("stuck", "could not compute a step"),
    "Invalid_Number_Detected": Status("stuck", "met values for which a formula gives no number"),
    "Not_Enough_Degrees_Of_Freedom": Status("stuck", "has fewer variables than equations, so that it did not start"),
    "Unrecoverable_Exception": Status("stuck", "broke off within itself"),
    "Internal_Error": Status("stuck", "broke off within itself"),
    "Insufficient_Memory": Status("broken", "ran out of memory"),
    "Invalid_Problem_Definition": Status("broken", "was given a problem that it does not take"),
    "Invalid_Option": Status("broken", "was given an option that it does not have"),
    "NonIpopt_Exception_Thrown": Status("interrupted", "was interrupted"),
}
"""All that IPOPT 3.14 has. CasADi turns an interrupt into the last one; an exception of a function's is
``Invalid_Number_Detected``."""


def status_of(name: str) -> Status:
    """A return status by IPOPT's name for it; one that is not known is ``broken``."""
    return STATUSES.get(name, Status("broken", f"ended with a status that is not known, {name[:80]!r}"))
