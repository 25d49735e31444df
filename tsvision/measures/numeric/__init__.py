"""Lines of numbers: fitted, smoothed, closed, summed, their spectrum."""
