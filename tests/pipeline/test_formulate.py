"""Programs of the stages, taken away: CasADi alone loads them, and other solvers find what the stages found."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_hands
from casadi_hands.errors import SolveError
from casadi_hands.nlp import SolverError
from casadi_hands.nlp.solver import Solver
from casadi_hands.pipeline import STAGES
from casadi_hands.pipeline.formulate import Formulation, formulate
from casadi_hands.task import Task, load_task
from tests.stages.synthesis.example import ball_task

CAPSULE = Path(__file__).parents[2] / "problems" / "horizontal_translation.yaml"
# What CasADi's wheel brings, with the options that these programs ask for.
SOLVERS: dict[str, tuple[str, dict[str, Any]]] = {
    "IPOPT": ("ipopt", {"ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-8}}),
    # Some of qrqp's steps fail, and SQP goes on with what there is.
    "SQP with qrqp": ("sqpmethod", {"qpsol": "qrqp", "qpsol_options": {"print_iter": False, "error_on_fail": False}}),
    "SQP with OSQP": ("sqpmethod", {"qpsol": "osqp", "qpsol_options": {"osqp": {"verbose": False, "eps_abs": 1e-9}}}),
    "Uno": ("uno", {}),
    "fatrop": ("fatrop", {}),
}
ALONE = """
import json, sys
import casadi as ca
import numpy as np

folder, solver, options, own = sys.argv[1], sys.argv[2], json.loads(sys.argv[3]), json.loads(sys.argv[4])
functions = {name: ca.Function.load(f"{folder}/{name}.casadi") for name in ("nlp", *own)}
numbers = dict(np.load(f"{folder}/program.npz"))
if own:  # derivatives, too, are those of the folder
    options |= {name: functions[name] for name in own} | {"no_nlp_grad": True, "calc_lam_p": False}
found = ca.nlpsol("solver", solver, functions["nlp"], {"print_time": False, **options})(**numbers)
g = np.array(found["g"]).ravel()
beyond = float(np.max([0.0, *(numbers["lbg"] - g), *(g - numbers["ubg"])]))
assert not [name for name in sys.modules if name.startswith(("casadi_hands", "pinocchio", "scipy"))]
print("\\n" + json.dumps({"objective": float(found["f"]), "violation": beyond}))
"""


def quick(task: Task, trials: int = 1, joints: int = 2) -> Task:
    changes = {"trials": trials, "recombinations": trials, "max_joints": joints}
    return task.model_copy(update={"search": task.search.model_copy(update=changes)})


def solved_alone(folder: Path, solver: str, options: dict[str, Any], own: tuple[str, ...] = ()) -> dict[str, float]:
    """What a solver of CasADi's finds in a process that has CasADi and NumPy and nothing of ours."""
    arguments = [str(folder), solver, json.dumps(options), json.dumps(own)]
    one = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ALONE, *arguments], env=one, cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


@pytest.fixture(scope="module")
def formulations() -> dict[str, Formulation]:
    """Of a ball's quick task, by stage."""
    return {stage: formulate(quick(ball_task()), stage, jobs=1) for stage in STAGES}


@pytest.fixture(scope="module")
def folders(formulations: dict[str, Formulation], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("programs")
    return {stage: formulations[stage].save(folder / stage).parent for stage in STAGES}


@pytest.mark.parametrize("name", SOLVERS)
def test_another_solver_finds_what_the_first_stage_found(
    name: str, formulations: dict[str, Formulation], folders: dict[str, Path]
) -> None:
    found = solved_alone(folders["floating"], *SOLVERS[name])
    assert found["objective"] == pytest.approx(formulations["floating"].solve.solution.objective, rel=1e-6)
    assert found["violation"] < 1e-6


@pytest.mark.parametrize("stage", ["floating", "whole_hand"])
def test_plain_casadi_repeats_the_stage_s_own_solve(
    stage: str, formulations: dict[str, Formulation], folders: dict[str, Path]
) -> None:
    solution = formulations[stage].solve.solution
    record = json.loads((folders[stage] / "program.json").read_text(encoding="utf-8"))
    found = solved_alone(folders[stage], "ipopt", {"ipopt": record["ipopt"]}, ("grad_f", "jac_g", "hess_lag"))
    assert found["objective"] == pytest.approx(solution.objective, rel=1e-9)
    assert record["found_by_the_stage"] == {
        "objective": solution.objective,
        "violation": solution.violation,
        "status": solution.status,
        "iterations": solution.iterations,
    }


@pytest.mark.parametrize("stage", STAGES)
def test_loaded_derivatives_agree_with_finite_differences(stage: str, folders: dict[str, Path]) -> None:
    nlp, grad_f, jac_g, hess_lag = (
        ca.Function.load(str(folders[stage] / f"{name}.casadi")) for name in ("nlp", "grad_f", "jac_g", "hess_lag")
    )
    with np.load(folders[stage] / "program.npz") as arrays:
        x, p = arrays["x0"], arrays["p"]
    rng, h = np.random.default_rng(0), 1e-6
    x = x + 1e-3 * rng.normal(size=x.size)
    multipliers = rng.normal(size=nlp.numel_out("g"))

    def slope(at: np.ndarray) -> np.ndarray:
        gradient = np.array(grad_f(at, p)[1]).ravel()
        return gradient + np.array(jac_g(at, p)[1]).T @ multipliers

    hessian = np.array(ca.triu2symm(hess_lag(x, p, 1.0, multipliers)))
    for _ in range(3):
        way = rng.normal(size=x.size) / np.sqrt(x.size)
        (f1, g1), (f0, g0) = (nlp(x + s * h * way, p) for s in (1, -1))
        gradient, jacobian = np.array(grad_f(x, p)[1]).ravel(), np.array(jac_g(x, p)[1])
        assert float(f1 - f0) / (2 * h) == pytest.approx(gradient @ way, abs=1e-5 * np.linalg.norm(gradient))
        rises = np.array(g1 - g0).ravel() / (2 * h)
        np.testing.assert_allclose(rises, jacobian @ way, atol=1e-5 * max(np.abs(rises).max(initial=0), 1))
        bent = (slope(x + h * way) - slope(x - h * way)) / (2 * h)
        np.testing.assert_allclose(hessian @ way, bent, atol=1e-3 * np.abs(bent).max())


@pytest.mark.parametrize("stage", STAGES)
def test_the_index_knows_what_everything_is(
    stage: str, formulations: dict[str, Formulation], folders: dict[str, Path]
) -> None:
    record = json.loads((folders[stage] / "program.json").read_text(encoding="utf-8"))
    formulation = formulations[stage]
    program, units = formulation.program, formulation.model.units
    assert (record["stage"], record["casadi"]) == (stage, ca.CasadiMeta.version())
    assert record["units_in_si"] == {"length": units.length, "force": units.force, "torque": units.torque, "time": 1.0}
    # Every entry of each vector has one name.
    for kind, size in (
        ("variables", len(program.x0)),
        ("parameters", len(program.p)),
        ("constraints", len(program.lbg)),
    ):
        places = [np.ravel(each["positions"]).astype(int) for each in record[kind].values()]
        assert sorted(np.concatenate([np.zeros(0, int), *places])) == list(range(size))
    undescribed = [
        name
        for kind in ("variables", "parameters")
        for name, each in record[kind].items()
        if not each["about"] and not each["unit"]
    ]
    assert undescribed == []
    assert all(each["about"] for each in record["terms"].values())
    total = sum(each["value_at_start"] for each in record["terms"].values())
    assert record["start"]["objective"] == pytest.approx(total, rel=1e-9)
    assert list(record["terms"]) == program.problem.terms


def test_the_solves_are_those_that_were_asked_for(formulations: dict[str, Formulation]) -> None:
    steps = {stage: each.step for stage, each in formulations.items()}
    knots = formulations["refine"].program.problem.variables["pose"].shape[0]
    assert steps.pop("refine").endswith(f" on {knots} knots")
    assert steps == {"floating": "free", "synthesis": "anneal 2", "whole_hand": "hand"}
    # Table 2.3: the last annealing step has limits as bounds.
    synthesis = formulations["synthesis"].program
    lowest, highest = formulations["synthesis"].model.joint_limits
    for name in synthesis.problem.variables.names():
        if name.startswith("angles"):
            at = synthesis.problem.variables[name]
            assert (set(synthesis.lbx[at].ravel()), set(synthesis.ubx[at].ravel())) == ({lowest}, {highest})


def test_another_seed_gives_another_program_of_later_stages(formulations: dict[str, Formulation]) -> None:
    first = formulations["synthesis"]
    other = formulate(quick(ball_task()), "synthesis", first.seed + 1, jobs=1)
    assert other.seed == first.seed + 1
    assert other.program.x0.shape != first.program.x0.shape or (other.program.x0 != first.program.x0).any()


def test_progress_is_told() -> None:
    told: list[str] = []
    formulate(quick(ball_task()), "floating", progress=lambda news: told.append(news.stage))
    assert told == ["floating"]


def test_a_stage_that_is_none_is_refused() -> None:
    with pytest.raises(SolveError, match="stage: given 'refined'; allowed: floating, synthesis, whole_hand, refine"):
        formulate(ball_task(), "refined")


def test_a_solver_that_breaks_off_is_told_and_a_mistake_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    for error, seen in ((SolverError("no memory"), SolveError), (RuntimeError("no memory"), RuntimeError)):

        def broken(*_: object, error: Exception = error) -> None:
            raise error

        monkeypatch.setattr(Solver, "solve", broken)
        with pytest.raises(seen, match="no memory") as raised:
            formulate(ball_task(), "floating")
        assert type(raised.value) is seen


def test_a_folder_that_cannot_be_written_is_told(formulations: dict[str, Formulation], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SolveError, match="file: cannot write the program here"):
        formulations["floating"].save(tmp_path / "file")


def test_it_is_a_name_of_the_package() -> None:
    assert casadi_hands.formulate is formulate


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_programs_of_a_task_of_the_thesis_are_solved_alone_as_by_the_stages(stage: str, tmp_path: Path) -> None:
    formulation = formulate(quick(load_task(CAPSULE), 2, 4), stage, jobs=1)
    folder, solution = formulation.save(tmp_path).parent, formulation.solve.solution
    derivatives = "grad_f", "jac_g", "hess_lag"
    options = formulation.solve.options.ipopt()
    found = solved_alone(folder, "ipopt", {"ipopt": options}, derivatives)
    assert found["objective"] == pytest.approx(solution.objective, rel=1e-6)
    assert found["violation"] <= max(solution.violation, 1e-8)
    if stage == "refine":
        # Hard constraints: what may slip is bounded.
        slips = formulation.program.problem.constraint_rows["rolling0.no_slip"]
        assert np.isfinite(formulation.program.ubg[slips]).all()
