"""Cycles to failure: models, fits with intervals and censoring, and the paper's claims."""
