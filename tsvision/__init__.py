"""Measure twisted strings from pictures, and find out what a model of them gets wrong."""

from tsvision.compiled import find_place

__version__ = "0.1.0"

find_place()
