from __future__ import annotations

from pathlib import Path

import pytest
from pictures import main, tiled
from PIL import Image

from tests.export.browser import needs_browser
from tests.export.example import example_design

COLORS = ((255, 0, 0), (0, 255, 0), (0, 0, 255))


def test_tiles_stand_row_by_row() -> None:
    whole = tiled([Image.new("RGB", (40, 20), color) for color in COLORS], 2, 20)
    assert whole.size == (40, 20)
    assert [whole.getpixel(place) for place in ((10, 5), (30, 5), (10, 15), (30, 15))] == [*COLORS, (255, 255, 255)]


@needs_browser
def test_a_page_is_drawn_at_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    example_design().save(tmp_path / "design")
    file, folder = str(tmp_path / "both.png"), str(tmp_path / "design")
    monkeypatch.setattr("sys.argv", ["pictures.py", file, folder, folder, "--at", "0", "1", "--size", "500", "400"])
    main()
    both = Image.open(file)
    assert both.size == (500, 800)
    first, second = (both.crop((0, top, 500, top + 400)) for top in (0, 400))
    assert first.tobytes() != second.tobytes()
    assert min(len(part.getcolors(200_000) or ()) for part in (first, second)) > 500  # neither is blank


def test_times_are_one_or_as_many_as_folders(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["pictures.py", "a.png", "x", "y", "z", "--at", "0", "1"])
    with pytest.raises(SystemExit):
        main()
    assert "allowed: one for all, or 3" in capsys.readouterr().err
