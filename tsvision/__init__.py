"""Measure twisted strings from pictures, and find out what a model of them gets wrong."""

from pathlib import Path

from tsvision.compiled import keep_current

__version__ = "0.1.0"

keep_current(Path(__file__).parent)
