"""Which flags cast doubt on a row."""

from __future__ import annotations

import pytest

from tsvision.flags import MEANING, REMARKS, doubtful


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", False),
        (float("nan"), False),
        (None, False),
        ("FIBRES", False),
        ("FIBRES|COIL_UNSURE", True),
        ("EDGE_POOR", True),
    ],
)
def test_fibres_cut_away_cast_no_doubt(text: object, expected: bool) -> None:
    assert doubtful(text) is expected


def test_remarks_are_flags() -> None:
    assert set(MEANING) > REMARKS
