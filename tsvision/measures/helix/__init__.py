"""EDGES -> HELIX: the silhouette of twisted strands, its fit, and where that may start."""
