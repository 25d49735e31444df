"""The paper's tables, cell by cell, against what its own numbers and the models give."""
