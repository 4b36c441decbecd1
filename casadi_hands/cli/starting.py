"""The commands that help to write a task: ``new``, ``examples``, ``fields``, ``schema``."""

from __future__ import annotations

import sys
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer

from casadi_hands.cli.options import Motion, Shape

Given = Annotated[str | None, typer.Argument(metavar="[NAME]", help="The example to copy.", show_default=False)]


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The task file to write.")] = Path("task.yaml"),
    shape: Annotated[Shape | None, typer.Option(help="Of the object.", show_default="capsule")] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="MM",
            help="Its sizes, mm: the diameter of a sphere; length and diameter of a capsule or cylinder; width, length "
            "and height of a box, which fingers hold across its width. With spaces between: '90 40'.",
            show_default="a hand's size",
        ),
    ] = None,
    mass: Annotated[
        float | None, typer.Option(metavar="G", help="Its mass, g.", show_default="of a solid of 500 kg/m³")
    ] = None,
    motion: Annotated[Motion | None, typer.Option(help="What it shall do.", show_default="turn")] = None,
    amount: Annotated[
        float | None, typer.Option(metavar="HOW_FAR", help="How far, mm or degrees.", show_default="a little")
    ] = None,
    fingers: Annotated[int | None, typer.Option(metavar="N", help="2 to 5.", show_default="3")] = None,
    table: Annotated[
        bool | None, typer.Option("--table/--no-table", help="The object lies on a table first.", show_default="no")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Of the task.", show_default="the file's")] = None,
) -> None:
    """Write a task file with comments, to be changed at will.

    In a terminal, what no option says is asked for; Enter takes what is in brackets. The file is then checked.
    """
    from rich.console import Console

    from casadi_hands.cli.examples import write_new
    from casadi_hands.cli.questions import ask, numbers
    from casadi_hands.cli.task_summary import check_summary
    from casadi_hands.task.loader import load_questioned
    from casadi_hands.task.starter import Idea, starter

    given: dict[str, Any] = {
        "shape": None if shape is None else shape.value,
        "size": None if size is None else numbers(size),
        "mass": mass,
        "motion": None if motion is None else motion.value,
        "amount": amount,
        "fingers": fingers,
        "table": table,
    }
    known = {what: value for what, value in given.items() if value is not None}
    idea = Idea(name or file.stem, **known)
    if sys.stdin.isatty():
        idea = ask(idea, known.keys())
    write_new(file, starter(idea))
    text, possible = check_summary(*load_questioned(file))
    Console().print(text)
    print(f"\nwritten: {file}\nnext: casadi-hands solve {quote(str(file))}")
    raise typer.Exit(0 if possible else 1)


def examples(
    name: Given = None,
    out: Annotated[Path | None, typer.Option(help="File to write.", show_default="NAME.yaml")] = None,
    show: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Write a page with a picture of each task.", show_default=False),
    ] = None,
) -> None:
    """List the tasks that come with the program, or copy one to begin with."""
    from rich.console import Console
    from rich.table import Table

    from casadi_hands.cli import examples as shipped

    if show is not None:
        shipped.show_examples(show)
        print(f"written: {show}\ncopy one: casadi-hands examples NAME")
    if name is None and show is None:
        table = Table.grid(padding=(0, 2))
        for each in shipped.examples():
            table.add_row(each.name, each.about + (" (a mesh)" if each.meshes else ""))
        Console().print(table)
        print("\nsee them: casadi-hands examples --show examples.html\ncopy one: casadi-hands examples NAME")
    if name is None:
        return
    path = shipped.copy_example(name, out)
    print(f"written: {path}\nnext: casadi-hands solve {quote(str(path))}")


def fields() -> None:
    """Print every field of a task file with its default and meaning (Markdown)."""
    from casadi_hands.task import describe_fields

    print(describe_fields())


def schema() -> None:
    """Print the JSON Schema of a task file, for editors that complete and check as you type."""
    from casadi_hands.task.schema import schema_text

    print(schema_text(), end="")
