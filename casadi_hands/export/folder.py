"""The result folder: every file of a design, written and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from casadi_hands.errors import ELSEWHERE, DesignError, TaskError
from casadi_hands.export.arrays import load_motion, save_motion
from casadi_hands.export.checked import read_record
from casadi_hands.export.commands import commanded
from casadi_hands.export.meshes import FOLDER, mesh_files
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.moving import remove_files
from casadi_hands.export.page.page import write_page
from casadi_hands.export.place import replace_folder, shown
from casadi_hands.export.record import STATUSES, design_record, hand_from_record, record_text
from casadi_hands.export.report.page import REPORT, write_report
from casadi_hands.export.table import motion_table
from casadi_hands.export.urdf import hand_urdf, object_urdf
from casadi_hands.problem.result import Result
from casadi_hands.problem.stored import read_json
from casadi_hands.task import load_task, task_to_yaml


def save_design(design: Result, directory: Path, page: bool = True) -> None:
    """Write a design's folder; of a partial design, the files for which there is something to write.

    They are written beside it and moved into place together: whoever reads the folder meanwhile finds an earlier design
    whole, or this one. Files of an earlier design are replaced or removed.

    Args:
        design: whole or partial (hand or motion None).
        directory: made if it does not exist.
        page: write the viewer, the report and the motion as a table too, which takes longer than all the rest.

    Raises:
        DesignError: the folder cannot be written, another process writes it, or the design holds what cannot be.
    """
    try:
        replace_folder(directory, lambda made: write_files(design, made, page))
    except OSError as error:
        raise DesignError(
            f"{shown(directory)}: cannot write the design here: {error.strerror or error}", ELSEWHERE
        ) from error


def write_files(design: Result, directory: Path, page: bool = True) -> None:
    """Write a design's files into a folder that nobody reads meanwhile.

    Args:
        design: as for `save_design`.
        directory: exists.
        page: as for `save_design`.

    Raises:
        DesignError: the design holds what cannot be written.
        OSError: the files cannot be written.
    """
    if design.status not in STATUSES:
        raise DesignError(f"a design's status is one of {', '.join(STATUSES)}, not {design.status!r}", "")
    motion = design.motion
    texts = {"task.yaml": task_to_yaml(design.task), "object.urdf": object_urdf(design.task)}
    if design.hand is not None:
        texts["hand.urdf"] = hand_urdf(design.hand)
        if motion is not None:
            if motion.joint_commands is None:
                motion = commanded(design.task, design.hand, motion)
            texts["scene.xml"] = scene_mjcf(design.task, design.hand, motion)
    if design.placement:
        texts["placement.json"] = record_text(design.placement)
    meshes = mesh_files(design.task)
    if meshes:
        (directory / FOLDER).mkdir(exist_ok=True)
    for name, text in {**meshes, **texts}.items():
        (directory / name).write_text(text, encoding="utf-8")
    if motion is not None:
        save_motion(motion, directory / "motion.npz")
        if page:  # for people, as the page is
            (directory / "motion.csv").write_text(motion_table(motion), encoding="utf-8")
    if page:
        write_page(design, directory / "viewer.html")
        write_report(design, directory / REPORT)
    (directory / "result.json").write_text(record_text(design_record(design)), encoding="utf-8")


def remove_design(directory: Path) -> None:
    """Remove a design's files, and the folder if it holds nothing else.

    Args:
        directory: what `save_design` wrote; need not exist.

    Raises:
        DesignError: the files cannot be removed.
    """
    try:
        remove_files(directory)
        if directory.is_dir() and not any(directory.iterdir()):
            directory.rmdir()
    except OSError as error:
        raise DesignError(f"{directory}: cannot remove the design here: {error}", ELSEWHERE) from error


def read_design(directory: Path) -> dict[str, Any]:
    """The fields of the design in a folder, by name.

    Args:
        directory: what `save_design` wrote.

    Raises:
        DesignError: there is no such folder, it is incomplete, or of another format.
    """
    while True:
        before = _which(directory)
        try:
            found = _read(directory)
        except DesignError:
            if _which(directory) == before:
                raise
        else:
            if _which(directory) == before:
                return found
        # Another design took its place meanwhile.


def _which(directory: Path) -> int | None:
    """The folder that has this name now."""
    return directory.stat().st_ino if directory.exists() else None


def _read(directory: Path) -> dict[str, Any]:
    record = read_record(directory)
    try:
        task = load_task(directory / "task.yaml", within=True)
    except TaskError as error:
        raise DesignError(f"{directory}: the design's task cannot be read: {error}") from error
    try:
        hand = hand_from_record(record)
    except DesignError as error:
        raise DesignError(f"{directory / 'result.json'}: {error}") from error
    motion = load_motion(directory / "motion.npz", task) if record["samples"] is not None else None
    joints = () if hand is None else hand.joint_names
    if motion is not None and motion.joint_names != joints:
        which = (
            "joints, and result.json has no hand"
            if hand is None
            else "other joints than those of the hand in result.json"
        )
        raise DesignError(f"{directory}: motion.npz moves {which}")
    return dict(
        task=task,
        status=record["status"],
        reason=record["reason"],
        hand=hand,
        motion=motion,
        costs=record["costs"],
        certificate=record["certificate"],
        replays=record.get("replays", []),  # earlier versions told of none
        stages=record["stages"],
        seconds=record["seconds"],
        placement=_read_placement(directory),
    )


def _read_placement(directory: Path) -> dict[str, Any]:
    """What the folder tells of contacts that the program placed, if it did."""
    path = directory / "placement.json"
    if not path.exists():
        return {}
    found = read_json(path)
    if not isinstance(found, dict):
        raise DesignError(f"{path}: is not what is told of contacts: no entries by their names")
    return found
