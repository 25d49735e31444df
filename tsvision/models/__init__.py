"""A shelf of displacement and bundle models, one a file."""
