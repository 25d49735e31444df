"""The page holds what was measured, moves as one, and lets nothing in or out."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.report.chromium import CHROMIUM, ask
from tests.report.fake_measurement import Fake, write_fake
from tsvision.errors import InputError
from tsvision.images.frames import open_recording
from tsvision.models import MODELS
from tsvision.report import page
from tsvision.report.digest import QUANTITIES, uncertainty_lines
from tsvision.report.many import write_overview
from tsvision.report.page import PICTURE_BYTES, as_script_json, write_report

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
EVIL = "<script>alert(1)<_script>_{:03d}.png"
VERDICT = {
    "status": "ambiguous",
    "causes": [
        {
            "name": "<b>axial_stretch</b>",
            "parameters": {"k": {"value": 0.06, "low": 0.05, "high": 0.07, "unit": "1"}},
        }
    ],
    "equivalent": [["axial_stretch"], ["radial_compression"]],
    "base": {"model": "constant_radius", "rmse_mm": 4.53},
    "extended": {"rmse_mm": 0.49},
    "gain": {"ratio": 8.2, "low": None, "high": None, "scheme": "leave-one-load-out"},
    "next_experiment": None,
    "residual": {"lack_of_fit_p": 0.4},
    "rows": [
        {"observable": "displacement_mm", "turns": t, "value": t, "base": 2.0 * t, "extended": t}
        for t in (0.0, 30.0, 66.0)
    ],
}


@pytest.fixture(scope="module")
def fake(tmp_path_factory: pytest.TempPathFactory) -> Fake:
    made = write_fake(tmp_path_factory.mktemp("report"), name=EVIL)
    write_report(made.measure_dir, open_recording(made.recording_dir), VERDICT)
    return made


def page_text(fake: Fake) -> str:
    return (fake.measure_dir / "report.html").read_text("utf-8")


def page_data(text: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert found
    return json.loads(found[1])


def test_page_needs_no_network_and_stays_small(fake: Fake) -> None:
    text = page_text(fake)
    for address in re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)""", text):
        assert address.startswith(("data:", "#")), address
    assert "default-src 'none'" in text
    assert len(text) < 3e6


def test_many_frames_share_one_budget_of_pictures(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 90), unreadable=None)
    path = write_report(made.measure_dir, open_recording(made.recording_dir))
    data = page_data(path.read_text("utf-8"))
    assert len(data["x"]) == 90
    assert 44 <= len(data["shown"]) <= 48
    assert {data["shown"][0]["at"], data["shown"][-1]["at"]} == {0, 89}
    pictures = sum(len(f["picture"]["href"]) for f in data["shown"])
    assert 0 < pictures < 1.4 * PICTURE_BYTES


def test_a_long_recording_is_thinned_in_the_plots_and_keeps_what_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page, "MOST_ROWS", 60)
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 200), unreadable=None)
    text = write_report(made.measure_dir).read_text("utf-8")
    data = page_data(text)
    assert 50 <= len(data["x"]) <= 60
    assert f"{len(data['x'])} of 200 frames, evenly chosen" in text
    for frame in data["shown"]:
        assert data["frames"][frame["at"]] == frame["frame"]


def test_names_that_look_like_html_stay_text(fake: Fake) -> None:
    text = page_text(fake)
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text
    assert "<b>axial_stretch" not in text
    assert page_data(text)["shown"][0]["card"][0] == ["file", EVIL.format(0)]


def test_every_row_is_there_and_unknown_is_null(fake: Fake) -> None:
    data = page_data(page_text(fake))
    assert len(data["x"]) == len(fake.rows)
    assert data["series"]["diameter"][5] is None
    assert data["flagged"][5] is True
    assert data["shown"][5]["picture"] is None
    assert data["shown"][5]["problem"]
    diameters = [r.diameter_mm for r in fake.rows if r.flags == ""]
    shown = [
        v for v, flag in zip(data["series"]["diameter"], data["flagged"], strict=True) if not flag
    ]
    np.testing.assert_allclose(shown, diameters, rtol=1e-5)


def test_prediction_is_the_shelf_s_model_at_the_measured_diameter(fake: Fake) -> None:
    data = page_data(page_text(fake))
    title = MODELS["constant_radius"].title
    assert next(iter(data["predicted"])) == title
    turn, got = data["x"][-1], data["predicted"][title][-1]
    want = np.hypot(23.2, 2.5 + 2 * np.pi * turn * 0.4841 / 2) - 23.2
    assert got == pytest.approx(want, rel=1e-5)


def test_phase_bands_meet_midway_and_cover_the_recording(fake: Fake) -> None:
    bands = page_data(page_text(fake))["bands"]
    assert [b[2] for b in bands] == ["twist", "overtwist", "local_overtwist", "knotted"]
    assert all(a[1] == b[0] for a, b in pairwise(bands))
    x = page_data(page_text(fake))["x"]
    assert (bands[0][0], bands[-1][1]) == (x[0], x[-1])


def test_unwinding_is_told_apart(tmp_path: Path) -> None:
    turns = np.r_[np.linspace(0, 60, 7), np.linspace(50, 0, 6)]
    made = write_fake(tmp_path, turns=turns, unreadable=3)
    text = write_report(made.measure_dir).read_text("utf-8")
    data = page_data(text)
    assert data["unwinding"] == [False] * 7 + [True] * 6
    assert data["bands"][0][0] == 0
    assert data["bands"][-1][1] == 60
    assert data["kymograph"]["x_label"] == "frame"
    assert "unwinding" in text


def test_words_for_each_kind_of_onset(fake: Fake) -> None:
    text = page_text(fake)
    assert "no irreversible knots up to 66 turns" in text
    assert re.search(r"undetermined \(95\s%\sinterval 30 to 40\)", text)
    assert "the picture could not be decoded; nothing was measured" in text
    assert "4.53 mm RMSE" in text
    assert "the pictures leave it open" in text
    assert re.search(r"safe at least up to 37.3 turns, 18.1\smm, 22.4\s%", text)
    assert "from &lt;b&gt;1&lt;/b&gt; to 2 turns" in text


def test_no_pictures_no_scale_no_displacement(tmp_path: Path) -> None:
    made = write_fake(tmp_path, scale=False, displacement=False)
    text = write_report(made.measure_dir).read_text("utf-8")
    data = page_data(text)
    assert data["unit"] == "px"
    assert "plot-displacement" not in text.split("<script")[0]
    assert all(f["picture"] is None for f in data["shown"])
    assert data["shown"][20]["profile"]["s"]
    assert "20.87 ± 0.15\u202fpx" in text
    assert "(mm)" not in re.sub(r"<script.*?</script>", "", text, flags=re.S)


def test_budgets_are_what_is_left_over(fake: Fake) -> None:
    data = page_data(page_text(fake))["series"]
    row = fake.rows[20]
    want = row.string_length_mm - 23.2 - row.displacement_mm
    assert data["string_budget"][20] == pytest.approx(want, rel=1e-4)
    assert data["turn_budget"][20] == pytest.approx(row.turns_seen - row.turns, rel=1e-4)


def test_the_scale_s_share_of_an_uncertainty() -> None:
    columns = [n for q in QUANTITIES for n in q[1:3]]
    frames = pd.DataFrame({n: [np.nan] * 3 for n in columns})
    frames["diameter_mm"], frames["diameter_mm_sd"] = 0.5, 0.01
    frames["mm_per_px"], frames["mm_per_px_sd"] = 0.02, 0.0002  # 1 % of D is 0.005 mm
    line = uncertainty_lines(frames)[0]
    assert line[0] == "outer diameter D"
    assert line[4:] == ("2\u202f%", "25\u202f%", 3)


def test_script_json_cannot_close_its_element() -> None:
    text = as_script_json({"a": "</script><!--", "b": float("nan")})
    assert "<" not in text
    assert json.loads(text) == {"a": "</script><!--", "b": None}


def test_a_folder_that_holds_no_measurement_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="tsvision measure"):
        write_report(tmp_path)


def test_overview_links_and_tells_equal_names_apart(tmp_path: Path) -> None:
    folders = []
    for i in range(3):
        folders.append(write_fake(tmp_path / f"a b {i}", displacement=False).measure_dir)
    write_report(folders[1])
    text = write_overview(folders, tmp_path / "over.html").read_text("utf-8")
    assert text.count('href="a%20b') == 1
    assert 'href="a%20b%201/measured/report.html"' in text
    assert all(str(f) in text for f in folders)
    with pytest.raises(InputError):
        write_overview([], tmp_path / "none.html")


MOVES = (Path(__file__).parent / "moves.js").read_text("utf-8")


@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_the_slider_moves_every_part(fake: Fake, tmp_path: Path, width: int) -> None:
    out, console = ask(fake.measure_dir / "report.html", MOVES, tmp_path, width)
    assert console == []
    assert "threw" not in out, out
    first, second = out["first"], out["second"]
    for part in ("where", "picture", "edges", "profile", "card"):
        assert first[part] != second[part], part
    assert len(first["marks"]) == out["plots"] == 9
    assert all(a != b for a, b in zip(first["marks"], second["marks"], strict=True))
    assert (out["left"], out["right"], out["home"], out["end"]) == ("14", "16", "0", "23")
    assert out["broken"]["shownPicture"] is False
    assert 10 <= out["clicked"] <= 13
    assert out["hidden"] == "none"
    assert out["confronted"] >= 6
    assert out["overflow"] <= 0
    assert out["unnamed"] == 0


LAYOUT = (Path(__file__).parent / "layout.js").read_text("utf-8")


@needs_chromium
@pytest.mark.parametrize("width", [1280, 500])
def test_nothing_lies_upon_another_and_every_axis_is_named(
    fake: Fake, tmp_path: Path, width: int
) -> None:
    out, _ = ask(fake.measure_dir / "report.html", LAYOUT, tmp_path, width)
    texts, marks, points = out.pop("seen")
    assert texts > 60 and marks >= 8 and points > 100
    assert out == {"texts": [], "outside": [], "blocks": [], "unnamed": [], "marks": []}


@needs_chromium
def test_overview_draws_without_complaint(fake: Fake, tmp_path: Path) -> None:
    page = write_overview([fake.measure_dir, fake.measure_dir], tmp_path / "over.html")
    script = """const page = document.documentElement;
        return [page.querySelectorAll('.plots path').length, page.scrollWidth - innerWidth];"""
    (paths, overflow), console = ask(page, script, tmp_path)
    assert console == []
    assert paths == 4
    assert overflow <= 0
