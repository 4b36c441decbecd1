"""The report as a file: what is in it, what is not, and what cannot get into it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.report import page
from casadi_hands.export.report.alternatives import read_alternatives
from casadi_hands.export.report.folder import report_folder
from casadi_hands.export.report.markup import number, percent, signed
from casadi_hands.export.report.page import report_text
from casadi_hands.export.report.words import figure_title, plain
from casadi_hands.task import parse_task
from tests.documents import ROOT
from tests.export.example import TASK, example_design, example_hand, example_task

NASTY = "</script><script>window.hacked = true</script><img src=x onerror='window.hacked = true'>"


def nasty_design():
    """A design with markup wherever a file can bring it."""
    task = parse_task(TASK.replace("move a capsule & back", f'"{NASTY}"'))
    hand = example_hand()
    fingers = (replace(hand.fingers[0], name=NASTY), *hand.fingers[1:])
    motion = example_design().motion
    return Design(
        task=task,
        status="feasible",
        reason=NASTY,
        hand=replace(hand, fingers=fingers),
        motion=replace(motion, contact_names=(NASTY, *motion.contact_names[1:])),
        costs={NASTY: {NASTY: {"weight": 1.0, "value": 1.0}}},
        certificate={NASTY: {"value": 2.0, "limit": 1.0, "holds": False, "unit": NASTY, "where": NASTY}},
        replays=[
            {
                "engine": NASTY,
                "goals": [],
                "mean": {"mm": 1.0, "degrees": 1.0},
                "dropped_as_planned": False,
                "dropped": 0,
                "of": 1,
                "perturbed": {NASTY: {"mean": {"mm": 1.0}, "largest": {"mm": 1.0}, "dropped": True}},
            }
        ],
        stages=[{"stage": NASTY, "annealing_step": NASTY, "status": NASTY, "objective": 1.0}],
        seconds={NASTY: 1.0},
    )


@pytest.fixture(scope="module")
def text():
    return report_text(example_design())


def test_nothing_is_loaded_and_little_is_needed(text):
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy
    # The one address is in the name of the library.
    assert set(re.findall(r"\b(?:https?|wss?|ftp)://[^\s\"'`)]*", text)) <= {
        "https://github.com/leeoniya/uPlot",
        "http://www.w3.org/2000/svg",
    }
    assert not re.search(r"<(?:script|img|link|iframe)[^>]*\b(?:src|href)=", text)
    assert not re.search(r"url\(|@import|fetch\(|XMLHttpRequest|WebSocket", text)
    assert len(text) < 1e6


def test_the_report_says_its_size(text):
    (told,) = re.findall(r"one file of ([\d.]+) MB", text)
    assert float(told) == pytest.approx(len(text.encode()) / 1e6, abs=0.05)


def test_what_is_shipped_for_it_is_small():
    folder = Path(page.__file__).parent
    assert sum(path.stat().st_size for path in folder.rglob("*") if path.suffix != ".pyc" and path.is_file()) < 2e5
    assert "Leon Sorokin" in (folder / "vendor/uPlot.LICENSE").read_text()


def test_the_plots_licence_is_in_the_page(text):
    assert "Permission is hereby granted" in text
    assert "Leon Sorokin" in text


def test_equal_designs_give_equal_reports(text):
    assert report_text(example_design()) == text


def test_names_from_files_cannot_become_markup():
    text = report_text(nasty_design())
    assert text.count("<script>window.hacked") == 0
    assert "<img" not in text
    assert text.count("&lt;img src=x") > 10
    data = json.loads(re.search(r'<script id="data"[^>]*>(.*?)</script>', text, re.S)[1])
    assert NASTY in data["plots"]["panels"][-1]["curves"][0]["label"]


def test_what_is_missed_comes_first_with_its_reason():
    design = replace(
        example_design(),
        reason="contact 'thumb' slips 10 mm; another seed",
        certificate={
            "gap": {"value": 1e-5, "limit": 5e-5, "holds": True, "unit": "m", "where": "a gap of 0.01 mm"},
            "slip": {
                "value": 0.01,
                "limit": 0.0002,
                "holds": False,
                "unit": "m",
                "where": "joint finger1_joint0 of finger 'index' slips 10 mm",
            },
            "spin": {"value": 3.0, "limit": None, "holds": True, "unit": "deg", "where": "spins"},
        },
    )
    text = report_text(design)
    order = [text.index(each) for each in ("<h3>Missed", "Slip of a contact", "<h3>Kept", "Gap between", "<h3>Told")]
    assert order == sorted(order)
    assert "Joint 1 of finger &#x27;index&#x27; slips 10 mm." in text
    assert "more than 1000 % of 0.2 mm" in text
    assert "20 % of 0.05 mm" in text
    assert "1 of 2 limits are kept" in text
    assert "Contact &#x27;thumb&#x27; slips 10 mm; another seed." in text


def test_every_figure_that_the_documents_explain_has_words_of_its_own():
    table = (ROOT / "docs" / "reading-the-verdict.md").read_text().split("## The figures")[1]
    first = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    names = [name for cell in first for name in re.findall("`(.+?)`", cell)]
    assert len(names) > 30
    assert [name for name in names if figure_title(name) == plain(name)] == []


def test_a_least_value_is_told_as_one():
    figure = {"value": 3.0, "limit": 1.0, "holds": True, "unit": "weight", "where": ""}
    text = report_text(replace(example_design(), certificate={"disturbance_radius": figure}))
    assert "at least 1 of the weight" in text


@pytest.mark.parametrize("part", ["nothing", "hand", "motion"])
def test_a_partial_design_has_a_report(part):
    whole = example_design()
    alone = replace(whole.motion, joint_names=(), joint_angles=np.zeros((21, 0)))
    design = Design(
        task=example_task(),
        status="failed",
        reason="no way",
        hand=whole.hand if part == "hand" else None,
        motion=alone if part == "motion" else None,
    )
    text = report_text(design)
    assert "No way." in text
    assert ("What to build" in text, "No stage has designed a hand" in text) == (True, part != "hand")
    assert ('data-panel="forces"' in text) == (part == "motion")


def test_a_folder_has_a_report_and_it_can_be_made_again(tmp_path):
    example_design().save(tmp_path)
    path = tmp_path / "report.html"
    first = path.read_text()
    path.unlink()
    assert report_folder(tmp_path) == path
    assert path.read_text() == first


def ranking(folder, **changes):
    entry = {"seed": 0, "status": "certified", "reason": "", "joints": [2, 2, 2], "margin": 0.31}
    entry |= {"torque": 0.2, "kept": True, "like": None}
    seeds = [entry, {**entry, "seed": 3, "margin": 0.1, **changes}]
    (folder / "alternatives").mkdir()
    (folder / "alternatives/ranking.json").write_text(json.dumps({"format": 1, "seeds": seeds}))


def test_alternatives_are_told_side_by_side(tmp_path):
    example_design().save(tmp_path)
    ranking(tmp_path)
    for seed in (0, 3):
        example_design().save(tmp_path / f"alternatives/seed{seed}")
    report_folder(tmp_path)
    text = (tmp_path / "report.html").read_text()
    assert text.count('class="card"') == 2
    assert 'href="alternatives/seed3/report.html"' in text
    assert "31 %" in text
    # Of a single solve nothing is told.
    assert 'class="card"' not in (tmp_path / "alternatives/seed3/report.html").read_text()


def test_a_ranking_from_elsewhere_is_escaped_or_refused(tmp_path):
    example_design().save(tmp_path)
    ranking(tmp_path, status="failed", reason=NASTY, kept=False)
    report_folder(tmp_path)
    assert "<script>window.hacked" not in (tmp_path / "report.html").read_text()
    (tmp_path / "alternatives/ranking.json").write_text('{"seeds": [{"seed": "../../x"}]}')
    with pytest.raises(DesignError, match=r"ranking\.json: cannot be read"):
        read_alternatives(tmp_path)


def test_a_folder_without_a_design_is_refused(tmp_path):
    with pytest.raises(DesignError, match=r"no result\.json"):
        report_folder(tmp_path)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("2.05e-08 mm", "2.05 × 10⁻⁸ mm"),
        ("1e+06", "1 × 10⁶"),
        ("-3 of finger-1", "−3 of finger-1"),
        ("scene1e-2x", "scene1e-2x"),
    ],
)
def test_numbers_are_printed_as_people_print_them(given, shown):
    assert number(given) == shown


def test_zero_has_no_sign():
    assert (signed(-0.04, 1), signed(-0.06, 1)) == ("0.0", "−0.1")
    assert (percent(0.0), percent(1e-9), percent(0.005)) == ("0 %", "less than 0.01 %", "0.5 %")
