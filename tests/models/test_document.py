"""docs/models.md says what the shelves say."""

from __future__ import annotations

from pathlib import Path

from tsvision.document import main, page
from tsvision.life.shelf import LIFE_MODELS
from tsvision.models import MODELS, SECTIONS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "models.md"


def test_the_page_is_current() -> None:
    """If not: `python -m tsvision.document docs/models.md`."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_everything_on_the_shelves_is_on_the_page() -> None:
    text = page()
    for name in (*MODELS, *SECTIONS):
        assert f"### {name}\n" in text
    assert all(f"`{name}`" in text for name in LIFE_MODELS)


def test_the_command_writes_it(tmp_path: Path) -> None:
    assert main([str(tmp_path / "models.md")]) == 0
    assert (tmp_path / "models.md").read_text(encoding="utf-8").startswith("# Models")
