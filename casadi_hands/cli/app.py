"""The commands; each imports what it needs when it runs, so that --help and a wrong option answer at once."""

from __future__ import annotations

import json
import os
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from casadi_hands.cli.check import check
from casadi_hands.cli.options import Folder, Jobs, Seed, Stage, TaskFile
from casadi_hands.cli.starting import examples, fields, new, schema
from casadi_hands.cli.studio import studio
from casadi_hands.cli.view import view

app = typer.Typer(
    name="casadi-hands",
    help="Design a robot hand for a task: its fingers, their joints and sizes, its motion and its forces.",
    epilog="Start with: `casadi-hands new`, or `casadi-hands examples`; then `casadi-hands solve task.yaml`",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"casadi-hands {version('casadi-hands')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options of the program itself."""


@app.command(epilog="Example: `casadi-hands solve task.yaml --out results/mine --seeds 3`")
def solve(
    task: Annotated[
        Path | None,
        typer.Argument(metavar="TASK", help="A task file (YAML); none with --resume.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write. A result in it makes way for a better one of the same task only, a certified one or "
            "one of another task only with --force.",
            show_default="results/TASK",
        ),
    ] = None,
    seed: Seed = None,
    seeds: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="N",
            help="Solve from N seeds, --seed and those that follow it: the folder then holds the best hand and, in "
            "alternatives/, up to four distinct ones.",
        ),
    ] = 1,
    start: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="DIR",
            help="Refine the hand of an earlier result of nearly the same task, which takes seconds; only where that "
            "gives no certified hand are all stages run.",
            show_default=False,
        ),
    ] = None,
    jobs: Jobs = None,
    executor: Annotated[
        str | None,
        typer.Option(
            metavar="dask://HOST:PORT",
            help="Run the search on a dask.distributed cluster, with the same result; --jobs is then for the replays. "
            "Needs distributed: pip install 'casadi-hands\\[dask]'",
            show_default="processes here",
        ),
    ] = None,
    until: Annotated[Stage, typer.Option(help="Stop after this stage and write what there is.")] = Stage.REFINE,
    force: Annotated[
        bool, typer.Option("--force", help="Replace whatever result is in the folder, once there is another.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the verdict, in a line.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what is done, and the verdict, as a line of JSON for each event.")
    ] = False,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Go on with the solve into DIR that was stopped, from the last trial or refinement that it had "
            "finished, with its task and options and to the same design.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Design a hand for a task.

    Exits 0 when there is a design that does the task (or all that --until asked for), 1 when there is none, 2 when
    the task cannot be used. What has been computed is written after every stage, and what has been finished is kept
    beside the folder, so that stopping it (Ctrl-C) loses nothing: --resume goes on from there.
    """
    from casadi_hands.cli.solving import Asked, solve_and_tell

    asked = Asked(task, out, seed, seeds, start, jobs, executor, until.value, force, resume, quiet, as_json)
    raise typer.Exit(solve_and_tell(asked))


@app.command(epilog="Example: `casadi-hands formulate task.yaml --out program --stage floating`")
def formulate(
    task: TaskFile,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write.", show_default=False)],
    stage: Annotated[Stage, typer.Option(help="Whose program.")] = Stage.REFINE,
    seed: Seed = None,
    jobs: Jobs = None,
) -> None:
    """Run the stages up to one, write the nonlinear program it poses, for CasADi alone, and print where its page is."""
    from casadi_hands.cli.interrupt import leave_on_interrupt
    from casadi_hands.cli.progress import Reporter
    from casadi_hands.task import load_task

    problem, reporter = load_task(task), Reporter(Console(stderr=True))

    def stopped() -> None:
        reporter.stop()
        reporter.note("stopped; nothing was written")

    with leave_on_interrupt(stopped), reporter:
        from casadi_hands.pipeline.formulate import formulate

        print(formulate(problem, stage.value, seed, jobs=jobs, progress=reporter.progress).save(out))


app.command(epilog="Example: `casadi-hands check task.yaml --show task.html`")(check)
app.command(epilog="Example: `casadi-hands studio task.yaml`")(studio)
app.command(epilog="Example: `casadi-hands view results/task --gif task.gif`")(view)


@app.command(epilog="Example: `casadi-hands report results/task`")
def report(folder: Folder) -> None:
    """Write a design's report.html anew, and print where: dimensions, plots, checks, motors, costs, other hands."""
    from casadi_hands.export.report.folder import report_folder

    print(report_folder(folder))


@app.command(epilog="Example: `casadi-hands export results/task --to csv`")
def export(
    folder: Folder,
    to: Annotated[
        str,
        typer.Option(
            metavar="TARGET",
            help="csv: the motion as a table. ros2: a package with ros2_control's tags, controllers and trajectories. "
            "urdf: the hand fixed to the world. usd: hand, object and scene in OpenUSD; needs urdf-usd-converter: "
            "pip install 'casadi-hands\\[usd]'",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="File (csv, urdf) or folder (ros2, usd) to write.", show_default="in DIR/export"),
    ] = None,
) -> None:
    """Write a design for another program, and print where."""
    from casadi_hands.export.targets import export_design

    print(export_design(folder, to, out))


@app.command(epilog="Example: `casadi-hands audit results/task --json`")
def audit(
    folder: Folder,
    task: Annotated[
        Path | None,
        typer.Option(help="Judge by this task file, which you trust, in place of the folder's.", show_default=False),
    ] = None,
    replays: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Replays with all perturbed at once, beside those with one thing; 0 for none."
        ),
    ] = 4,
    jobs: Jobs = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Recompute a design's certificate from its files, without the optimiser.

    Exits 1 if any figure misses its limit.
    """
    import casadi_hands.verify as verify
    from casadi_hands.cli.summary import audit_summary

    found = verify.audit(folder, task=task, replays=replays, jobs=jobs or os.cpu_count() or 1)
    if as_json:
        record = {
            "task": found.name,
            "certified": found.certified,
            "certificate": found.as_certificate(),
            "reasons": found.reasons,
            "notes": list(found.notes),
        }
        print(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))
    else:
        Console().print(audit_summary(found))
    raise typer.Exit(0 if found.certified else 1)


@app.command(epilog="Example: `casadi-hands replay results/task --perturb 10`")
def replay(
    folder: Folder,
    perturb: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Replay with one thing perturbed at a time, too, and N times with everything at once.",
        ),
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the perturbations.")] = 0,
    engine: Annotated[
        str, typer.Option(metavar="NAME", help="mujoco or drake; Drake needs pip install 'casadi-hands\\[drake]'")
    ] = "mujoco",
    jobs: Jobs = None,
    video: Annotated[
        Path | None,
        typer.Option(help="Write a film of the replay in MuJoCo as planned (.mp4 or .gif).", show_default=False),
    ] = None,
) -> None:
    """Play a design in a physics engine and say how far the object strays from the plan and from each goal.

    Exits 1 if the object misses a goal by more than the task's limits when nothing perturbs it, or is dropped then, or
    in more of the perturbed replays than the task's limits allow.
    """
    import casadi_hands.verify as verify
    from casadi_hands.cli.summary import replay_summary

    played = verify.run_replays(folder, perturb, seed, jobs or os.cpu_count() or 1, engine)
    if video is not None:
        from casadi_hands.verify.replays.video import film

        film(folder, video)
    Console().print(replay_summary(played))
    raise typer.Exit(0 if all(figure.holds for figure in played.figures()) else 1)


app.command(epilog="Example: `casadi-hands new pill.yaml --shape capsule --size '50 20' --mass 30 --motion turn`")(new)
app.command(epilog="Example: `casadi-hands examples pencil_pick_up --out pencil.yaml`")(examples)
app.command(epilog="Example: `casadi-hands fields > task-fields.md`")(fields)
app.command(epilog="Example: `casadi-hands schema > task.schema.json`")(schema)
