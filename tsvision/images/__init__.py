"""PICTURE -> STRINGS: frames, scale, separator, axis."""
