"""A shelf of candidate causes, one a file."""
