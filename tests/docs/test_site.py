"""The site builds offline with every page and without one broken link."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from tsvision.records import FrameRow, KnotSighting, Profile

ROOT = Path(__file__).parents[2]


def _hook() -> object:
    spec = importlib.util.spec_from_file_location("hook", ROOT / "docs" / "reference_hook.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("noun", [FrameRow, KnotSighting, Profile])
def test_every_column_has_a_meaning(noun: type) -> None:
    for field in fields(noun):
        assert _hook().meaning_of(field.name)  # type: ignore[attr-defined]


@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="mkdocs is not installed")
def test_the_site_builds_strictly_and_fetches_nothing(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr[-3000:]
    index = (tmp_path / "index.html").read_text("utf-8")
    for address in re.findall(r"""<(?:script|link|img)[^>]*(?:src|href)=["']?([^"' >]+)""", index):
        assert not address.startswith(("http:", "https:", "//")), address
    assert (tmp_path / "reference" / "columns.html").is_file()
