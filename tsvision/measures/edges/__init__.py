"""STRIP -> EDGES: a frame cut along its axis, and where both edges of its bundle lie."""
