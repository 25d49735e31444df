"""What a measured recording leaves on disk: writing it whole or not at all, and reading it."""

from tsvision.results.read import Measurement, read_measurement

__all__ = ["Measurement", "read_measurement"]
