"""The set-up page: local, guarded by its token, and what it writes is what was dragged."""

from __future__ import annotations

import http.client
import json
import re
import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.report.chromium import CHROMIUM, drawn
from tests.report.fake_measurement import fake_frame, write_fake
from tsvision.errors import InputError
from tsvision.images.frames import open_recording
from tsvision.records import FrameResult, Recording
from tsvision.report.setup import make_server
from tsvision.report.setup_server import SetupServer
from tsvision.report.setup_state import first_readable, given_rig, rig_text, save_rig
from tsvision.rig import load_rig


def fake_measure(recording: Recording, index: int) -> FrameResult:
    row, profile, _ = fake_frame(index, recording.files[index], 30.0, False)
    return FrameResult(row, profile)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[SetupServer, Path]]:
    made = write_fake(tmp_path, unreadable=0)
    rig = tmp_path / "rig.toml"
    server = make_server(open_recording(made.recording_dir), rig, measure=fake_measure)
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server, rig
    server.stop()
    thread.join(10)
    assert not thread.is_alive()


def request(
    server: SetupServer, method: str, path: str, body: Any = None, **headers: str
) -> tuple[int, bytes]:
    link = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    sent = None if body is None else json.dumps(body)
    link.request(method, path, sent, {k.replace("_", "-"): v for k, v in headers.items()})
    reply = link.getresponse()
    found = reply.status, reply.read()
    link.close()
    return found


def test_nobody_gets_in_without_the_token(served: tuple[SetupServer, Path]) -> None:
    server, rig = served
    good = f"/{server.token}/"
    assert request(server, "GET", good)[0] == 200
    assert request(server, "GET", "/")[0] == 404
    assert request(server, "POST", "/save", {})[0] == 404
    assert request(server, "POST", "/x/save", {})[0] == 404
    assert request(server, "GET", good, Host=f"evil.example:{server.port}")[0] == 404
    assert request(server, "POST", good + "save", {}, Origin="http://evil.example")[0] == 404
    assert request(server, "POST", good + "eval", {})[0] == 404
    assert not rig.exists()
    assert len(server.token) >= 20


def test_odd_bodies_are_refused(served: tuple[SetupServer, Path]) -> None:
    server, _ = served
    path = f"/{server.token}/try"
    assert request(server, "POST", path, [1])[0] == 400
    assert request(server, "POST", path, "x" * 200_000)[0] == 400
    deep = "[" * 50_000
    link = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    link.request("POST", path, deep)
    assert link.getresponse().status == 400
    link.close()


def test_looking_again_measures_with_the_fields_given(served: tuple[SetupServer, Path]) -> None:
    server, _ = served
    ask = f"/{server.token}/try"
    status, reply = request(server, "POST", ask, {"strings.count": "2", "frame": 3})
    found = json.loads(reply)
    assert status == 200
    assert found["found"] is True
    assert found["paths"]["upper"].startswith("M")
    status, reply = request(server, "POST", ask, {"strings.count": "0", "frame": 3})
    assert "strings.count" in json.loads(reply)["problem"]


def test_saving_writes_the_file_and_ends_the_server(tmp_path: Path) -> None:
    made = write_fake(tmp_path)
    rig = tmp_path / "rig.toml"
    rig.write_text("# mine\n[strings]\ncount = 4\n")
    server = make_server(open_recording(made.recording_dir), rig, measure=fake_measure)
    thread = threading.Thread(target=server.serve)
    thread.start()
    fields = {"strings.count": "2", "view.roi_px": [10, 20, 300, 200], "camera.mm_per_px": "0,023"}
    status, reply = request(server, "POST", f"/{server.token}/save", {**fields, "frame": 0})
    assert (status, json.loads(reply)["saved"]) == (200, str(rig))
    thread.join(10)
    assert not thread.is_alive()
    told = load_rig(rig)
    assert told.view.roi_px == (10, 20, 300, 200)
    assert told.camera.mm_per_px == 0.023
    assert told.strings.count == 2
    assert (tmp_path / "rig.toml.old").read_text().startswith("# mine")


def test_every_key_survives_the_writing() -> None:
    fields = {
        "strings.count": 6,
        "strings.diameter_mm": "0.24",
        "actuator.load_N": 19.61,
        "camera.scale_from": "length",
        "camera.length_mm": "23,2",
        "camera.points_px": [[1.5, 2], [300.25, 4]],
        "view.separator_side": "left",
        "view.axis_px": [[20.5, 60], [220, 61]],
        "view.roi_px": None,
    }
    text = rig_text(fields)
    tree = tomllib.loads(text)
    assert tree["camera"]["points_px"] == [[1.5, 2], [300.25, 4]]
    assert tree["camera"]["length_mm"] == 23.2
    assert "roi_px" not in tree["view"]
    assert "# roi_px" in text
    rig = given_rig(fields)
    assert (rig.strings.count, rig.view.separator_side) == (6, "left")
    assert rig.view.axis_px == ((20.5, 60.0), (220.0, 61.0))


@pytest.mark.parametrize(
    "fields",
    [{"strings.count": "two"}, {"camera.mm_per_px": -1}, {"strings.colour": "red"}],
)
def test_bad_values_are_named_and_nothing_is_written(fields: dict, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=next(iter(fields))):
        save_rig(tmp_path / "rig.toml", fields)
    assert not list(tmp_path.iterdir())


def test_text_cannot_break_out_of_its_line() -> None:
    fields = {"camera.scale_from": "charuco", "camera.board": 'a"\n[strings]\ncount = 9\n#'}
    assert "strings" not in {k for k, v in tomllib.loads(rig_text(fields)).items() if v}


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_the_page_shows_what_was_found(served: tuple[SetupServer, Path], tmp_path: Path) -> None:
    page, console = drawn(served[0].address, tmp_path)
    assert console == []
    assert "Found; is it right?" in page
    assert re.search(r'data-lines="upper lower"[^>]* d="M\d', page)
    assert page.count("<circle") == 6


def test_the_frame_shown_can_be_chosen(tmp_path: Path) -> None:
    made = write_fake(tmp_path, unreadable=5)
    recording = open_recording(made.recording_dir)
    assert first_readable(recording, 5).index == 6
    with pytest.raises(InputError, match="0 to 23"):
        first_readable(recording, 24)


def test_the_page_asks_for_another_frame_and_a_failure_is_told(
    served: tuple[SetupServer, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    server, _ = served
    ask = f"/{server.token}/"
    shown = json.loads(request(server, "POST", ask + "frame", {"frame": 7})[1])
    assert shown["frame"] == 7 and shown["href"].startswith("data:image/jpeg")
    for wrong in ({"frame": 24}, {"frame": "7"}, {"frame": True}, {}):
        assert "frame" in json.loads(request(server, "POST", ask + "frame", wrong)[1])["problem"]

    def fails(*given: Any) -> dict[str, Any]:
        raise ZeroDivisionError("no ground")

    monkeypatch.setattr("tsvision.report.setup.try_rig", fails)
    status, reply = request(server, "POST", ask + "try", {"frame": 7})
    assert status == 200 and "ZeroDivisionError: no ground" in json.loads(reply)["problem"]


def test_names_stay_text(tmp_path: Path) -> None:
    made = write_fake(tmp_path, name="<script>alert(1)<_script>_{:03d}.png")
    server = make_server(open_recording(made.recording_dir), tmp_path / "rig.toml")
    thread = threading.Thread(target=server.serve)
    thread.start()
    status, page = request(server, "GET", f"/{server.token}/")
    server.stop()
    thread.join(10)
    assert status == 200
    assert rb"\u003cscript\u003ealert(1)" in page
    assert b"<script>alert" not in page
