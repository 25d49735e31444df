"""Measure twisted strings from pictures, and find out what a model of them gets wrong."""

__version__ = "0.1.0"
