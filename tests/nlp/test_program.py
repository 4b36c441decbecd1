"""A posed program: the numbers that are solved, functions without machine code, its index, and the folder of it all."""

from __future__ import annotations

import base64
import json
import re
import struct
import zlib
from pathlib import Path
from xml.etree import ElementTree

import casadi as ca
import numpy as np
import pytest

from casadi_hands.nlp import Constraint, Kernel, Options, Problem, Solver, Term
from casadi_hands.nlp.program import Program
from casadi_hands.nlp.program_folder import save_program
from casadi_hands.nlp.program_index import Quantity, program_index
from casadi_hands.nlp.solver import keep_solves
from casadi_hands.nlp.sparsity_picture import sparsity_picture

TARGETS = np.array([[0.2, 1.4], [-0.3, 0.8], [1.5, 0.1]])
GIVEN = {"targets": TARGETS, "weight.near": 2.0, "weight.smooth": 0.7}
START = {"points": TARGETS * 1.2}
TIGHT = Options(max_iter=200, tol=1e-10, acceptable_tol=1e-10, constr_viol_tol=1e-10)


def chain() -> Problem:
    """Three points near targets, smooth, each outside a circle and within a box; their sum is given."""
    problem = Problem()
    points = problem.variable("points", (3, 2), -1.0, [[1.1, 2.0]], quantity="x")
    near, smooth, outside = Kernel("near"), Kernel("smooth"), Kernel("outside")
    declared = Term("near", "Far from its target", "eq. 1", "m")
    near.cost(declared, near.variable("x", 2) - near.parameter("target", 2))
    problem.bind(near, x=points, target=problem.parameter("targets", (3, 2), quantity="target"))
    before, after = (smooth.variable(f"x{i}", 2, "x", i) for i in range(2))
    smooth.cost(Term("smooth", form="sum"), (after - before) ** 2)
    problem.bind(smooth, x=(points.take([0, 1]), points.take([1, 2])))
    at = outside.variable("x", 2)
    outside.constrain(Constraint("radius", "eq. 2", "length", "stay outside"), ca.sumsqr(at))
    outside.constrain(Constraint("height"), at[1] - at[0] ** 2)
    problem.bind(outside, {"radius": (1.0, np.inf), "height": (0.1, 0.1)}, x=points)
    return problem


@pytest.fixture(scope="module")
def solver() -> Solver:
    return Solver(chain())


@pytest.fixture(scope="module")
def program(solver: Solver) -> Program:
    return solver.program(START, GIVEN, {"points": -0.9}, None, {"outside.radius": (1.1, 3.0)})


def test_numbers_are_those_of_the_arguments(program: Program) -> None:
    assert set(program.numbers) == {"x0", "p", "lbx", "ubx", "lbg", "ubg"}
    np.testing.assert_array_equal(program.lbx, np.full(6, -0.9))
    np.testing.assert_array_equal(program.ubx.reshape(3, 2), np.tile([1.1, 2.0], (3, 1)))
    # Clipped into its bounds.
    np.testing.assert_array_equal(program.x0, np.clip(1.2 * TARGETS, -0.9, [1.1, 2.0]).ravel())
    np.testing.assert_array_equal(program.lbg.reshape(3, 2), np.tile([1.1, 0.1], (3, 1)))
    np.testing.assert_array_equal(program.ubg.reshape(3, 2), np.tile([3.0, 0.1], (3, 1)))
    assert program.p[program.problem.parameters["weight.smooth"]] == 0.7


def test_solves_are_kept_as_they_were_posed_and_only_where_asked(solver: Solver, program: Program) -> None:
    changes = {"points": -0.9}, None, {"outside.radius": (1.1, 3.0)}
    with keep_solves() as solves:
        with keep_solves() as inner:
            solver.solve(START, GIVEN, TIGHT, *changes)
        found = Solver(chain()).solve(START, GIVEN)
    solver.solve(START, GIVEN)
    assert len(inner) == len(solves) == 1
    for name, array in program.numbers.items():
        np.testing.assert_array_equal(inner[0].program.numbers[name], array)
    assert inner[0].options is TIGHT
    assert solves[0].solution is found
    assert solves[0].options == Options()


def test_what_is_posed_is_what_is_solved(solver: Solver) -> None:
    with keep_solves() as solves:
        found = solver.solve(START, GIVEN, TIGHT)
    plain = ca.nlpsol("plain", "ipopt", solves[0].program.functions["nlp"], quiet(1e-10))
    answer = plain(**solves[0].program.numbers)
    assert float(answer["f"]) == pytest.approx(found.objective, abs=1e-6)
    np.testing.assert_allclose(np.array(answer["x"]).ravel(), found.values["points"].ravel(), atol=1e-6)


def quiet(tol: float) -> dict[str, object]:
    return {"ipopt": {"print_level": 0, "sb": "yes", "tol": tol}, "print_time": False}


def test_functions_give_the_very_numbers_that_machine_code_gives(solver: Solver, program: Program) -> None:
    rng = np.random.default_rng(1)
    for _ in range(3):
        x, multipliers = rng.normal(size=6), rng.normal(size=6)
        for name, function in program.functions.items():
            inputs = (x, program.p, 0.7, multipliers)[: function.n_in()]
            for own, compiled in zip(function.call(inputs), solver.functions[name].call(inputs), strict=True):
                np.testing.assert_array_equal(np.array(own), np.array(compiled))
                assert own.sparsity() == compiled.sparsity()


def test_functions_refer_to_nothing_outside(program: Program) -> None:
    assert set(program.functions) == {"nlp", "grad_f", "jac_g", "hess_lag", "terms"}
    for function in program.functions.values():
        inner = {name for each in found(function) for name in [each.class_name()]}
        assert inner <= {"MXFunction", "SXFunction", "Map"}


def found(function: ca.Function) -> list[ca.Function]:
    """A function and all that it calls."""
    names = function.get_function()
    return [function, *[each for name in names for each in found(function.get_function(name))]]


def test_values_at_the_start(program: Program) -> None:
    points, values = program.x0.reshape(3, 2), program.at_start
    near, smooth = 2.0 * ((points - TARGETS) ** 2).sum(), 0.7 * (np.diff(points, axis=0) ** 2).sum()
    assert values.terms == pytest.approx({"near": near, "smooth": smooth}, rel=1e-12)
    assert values.f == pytest.approx(near + smooth, rel=1e-12)
    radius, height = (points**2).sum(axis=1), points[:, 1] - points[:, 0] ** 2
    np.testing.assert_allclose(values.g.reshape(3, 2), np.column_stack([radius, height]), rtol=1e-12)
    beyond = np.column_stack([np.maximum(np.maximum(1.1 - radius, radius - 3), 0), np.abs(height - 0.1)])
    np.testing.assert_allclose(values.beyond.reshape(3, 2), beyond, atol=1e-12)
    jacobian = values.jacobian.toarray()
    np.testing.assert_allclose(jacobian[::2], radial(points), rtol=1e-12)
    pulls = np.zeros((3, 2))
    pulls[:-1] += points[:-1] - points[1:]
    pulls[1:] += points[1:] - points[:-1]
    np.testing.assert_allclose(values.gradient.reshape(3, 2), 4 * (points - TARGETS) + 1.4 * pulls, rtol=1e-12)


def radial(points: np.ndarray) -> np.ndarray:
    """Derivatives (3, 6) of squared radii."""
    rows = np.zeros((3, 6))
    for k, point in enumerate(points):
        rows[k, 2 * k : 2 * k + 2] = 2 * point
    return rows


def test_the_index_says_what_stands_where(program: Program) -> None:
    index = program_index(program, {"points": Quantity("places", "m")})
    assert index["casadi"] == ca.CasadiMeta.version()
    sizes = {"variables": 6, "parameters": 8, "constraints": 6, "equations": 3, "inequalities": 3, "terms": 2}
    assert index["sizes"].items() >= sizes.items()
    points = index["variables"]["points"]
    assert (points["about"], points["unit"], points["shape"]) == ("places", "m", [3, 2])
    np.testing.assert_array_equal(program.x0[points["positions"]], program.x0.reshape(3, 2))
    assert (points["lower"], points["upper"]) == (-0.9, 2.0)
    assert points["scale"]["value"] == np.abs(program.x0).max()
    assert points["scale"]["gradient"] == np.abs(program.at_start.gradient).max()
    assert points["scale"]["jacobian_column"] == np.abs(program.at_start.jacobian.toarray()).max()
    np.testing.assert_array_equal(program.p[index["parameters"]["targets"]["positions"]], TARGETS)
    near = index["terms"]["near"]
    assert (near["about"], near["equation"], near["unit"], near["form"]) == (
        "Far from its target",
        "eq. 1",
        "m",
        "square",
    )
    assert (near["weight"], near["value_at_start"]) == (2.0, program.at_start.terms["near"])
    radius = index["constraints"]["outside.radius"]
    assert (radius["equation"], radius["unit"], radius["cannot"]) == ("eq. 2", "length", "stay outside")
    assert (radius["equations"], index["constraints"]["outside.height"]["equations"]) == (0, 3)
    largest = np.abs(radial(program.x0.reshape(3, 2))).max(axis=1)
    assert radius["scale"] == {"smallest_row": largest.min(), "largest_row": largest.max()}
    points_outside = (program.x0.reshape(3, 2) ** 2).sum(axis=1)
    np.testing.assert_allclose(program.at_start.g[radius["positions"]].ravel(), points_outside)


def test_numbers_that_are_none_are_null(solver: Solver) -> None:
    index = program_index(solver.program({"points": np.nan}, GIVEN, {"points": -np.inf}), {})
    assert index["variables"]["points"]["lower"] is None
    assert index["variables"]["points"]["scale"]["value"] is None
    assert index["start"]["objective"] is None
    json.dumps(index, allow_nan=False)


def test_the_folder_reads_back(program: Program, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "program"
    save_program(program, folder, "points & <targets>", {"seed": 3}, {})
    record = json.loads((folder / "program.json").read_text(encoding="utf-8"))
    assert (record["title"], record["seed"]) == ("points & <targets>", 3)
    with np.load(folder / "program.npz") as arrays:
        assert set(arrays) == set(program.numbers)
        for name in arrays:
            np.testing.assert_array_equal(arrays[name], program.numbers[name])
    for name, told in record["functions"].items():
        loaded = ca.Function.load(str(folder / told["file"]))
        assert (loaded.name_in(), loaded.name_out()) == (told["inputs"], told["outputs"])
        inputs = (program.x0, program.p, 1.0, np.ones(6))[: loaded.n_in()]
        for own, read in zip(program.functions[name].call(inputs), loaded.call(inputs), strict=True):
            np.testing.assert_array_equal(np.array(own), np.array(read))


def test_the_page_needs_nothing_else(program: Program, tmp_path: Path) -> None:
    save_program(program, tmp_path, "points & <targets>", {"seed": 3, "found": {"objective": 1.5}}, {})
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<h1>points &amp; &lt;targets&gt;</h1>" in page
    assert "objective 1.5" in page
    assert all(text in page for text in ("near", "smooth", "eq. 1", "outside.radius", "points"))
    assert page.count("<svg") == 2
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert "://" not in page.replace("http://www.w3.org/2000/svg", "")


def test_a_picture_shows_each_nonzero_and_the_blocks() -> None:
    places = np.array([0, 1, 2, 0]), np.array([0, 1, 2, 3])
    picture = sparsity_picture(places, (3, 4), {"g": (0, 3)}, {"a&b": (0, 2), "c": (2, 4)})
    tree = ElementTree.fromstring(picture)
    texts = [each.text for each in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == ["g", "a&b", "c"]
    (image,) = tree.iter("{http://www.w3.org/2000/svg}image")
    pixels = decoded(base64.b64decode(image.attrib["href"].split(",")[1]))
    np.testing.assert_array_equal(pixels < 255, [[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]])


def test_a_large_pattern_becomes_a_small_picture() -> None:
    diagonal = np.arange(5000)
    picture = sparsity_picture((diagonal, diagonal), (5000, 2500 * 2), {}, {})
    pixels = decoded(base64.b64decode(re.search(r"base64,([^\"]*)", picture)[1]))  # type: ignore[index]
    assert pixels.shape == (640, 640)
    np.testing.assert_array_equal(pixels < 255, np.eye(640, dtype=bool))


def decoded(png: bytes) -> np.ndarray:
    """Pixels of a grey PNG without filters."""
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    chunks, at = {}, 8
    while at < len(png):
        (size,) = struct.unpack(">I", png[at : at + 4])
        content = png[at + 4 : at + 8 + size]
        assert zlib.crc32(content) == struct.unpack(">I", png[at + 8 + size : at + 12 + size])[0]
        chunks[content[:4]] = content[4:]
        at += 12 + size
    width, height = struct.unpack(">II", chunks[b"IHDR"][:8])
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, width + 1)
    assert not lines[:, 0].any()
    return lines[:, 1:]
