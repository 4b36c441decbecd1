"""How far from the threshold do fingers with too few joints score, and fingers with enough?

    python scripts/score_margin.py

The same motion without and with gravity: one joint a finger is enough for the first, two for the second. Scores are
those of the best hand where all fingers have one joint, and where all have two; ratios are to the default threshold.
"""

from __future__ import annotations

import os
from pathlib import Path

from shared import SEEDS, options_of, write_table

from casadi_hands.execution.processes import processes
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.synthesis.algorithm import Candidate, Search
from casadi_hands.stages.synthesis.score import THRESHOLD
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.task import Task, load_task

PROBLEMS = Path(__file__).parents[1] / "problems"
TASKS = ("horizontal_translation_no_gravity.yaml", "horizontal_translation.yaml")
HEAD = ("task", "seed", "joints", "scores", "ratios to the threshold")


def main() -> None:
    """Score hands of one and of two joints a finger."""
    parser = options_of(__doc__)
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS), help="seeds of the search")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    given = parser.parse_args()
    rows: list[list[str]] = []
    ratios: dict[tuple[str, str], list[float]] = {}
    for name in TASKS:
        task = load_task(PROBLEMS / name)
        model = build_model(task)
        # The object's motion does not depend on the seed.
        target = target_of(model, FloatingStage(model).solve(dict(task.weights.floating)))
        for seed in given.seeds:
            for joints in (1, 2):
                best = best_hand(task, target, seed, joints, given.jobs)
                shares = [score / THRESHOLD for score in best.scores]
                structure = "+".join(map(str, best.joints))
                rows.append([task.name, str(seed), structure, _numbers(best.scores), _numbers(shares)])
                ratios.setdefault((task.name, structure), []).extend(shares)
            write_table(HEAD, rows)
    spans = [[*key, f"{min(values):.2f} to {max(values):.2f}"] for key, values in ratios.items()]
    write_table(("task", "joints", f"ratios to {THRESHOLD}, all seeds and fingers"), spans)


def best_hand(task: Task, target: Target, seed: int, joints: int, jobs: int) -> Candidate:
    """The best hand of Algorithm 1 where every finger has this many joints."""
    settings = task.search
    with processes(jobs) as executor:
        search = Search(
            target,
            dict(task.weights.synthesis),
            trials=settings.trials,
            recombinations=settings.recombinations,
            max_joints=joints,
            threshold=None,
            seed=seed,
            executor=executor,
            progress=lambda text: None,
        )
        return search.run(dict.fromkeys(search.contacts, joints)).candidates[0]


def _numbers(values: tuple[float, ...] | list[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


if __name__ == "__main__":
    main()
