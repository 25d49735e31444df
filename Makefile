# `make demo` and `make test` need Python >= 3.11 and make, nothing else.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: demo test test-all lint types docs bench fuzz wheel clean

$(STAMP): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[dev,docs]"
	touch $(STAMP)

demo: $(STAMP)
	$(BIN)/tsvision demo --out demo --overwrite

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

# within ten minutes on two cores; what takes longer is marked slow
test: lint types
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow"

test-all: lint types
	$(BIN)/python -m pytest -n 2 --dist worksteal

docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "open site/index.html"

# speed, memory over a long film, and what is handed out, in one run (some 20 minutes)
bench: $(STAMP)
	$(BIN)/python -m tests.bench.speed
	$(BIN)/python -m tests.bench.soak --frames 20000 --width 480
	$(BIN)/python -m tests.bench.wheel

fuzz: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[fuzz]"
	$(BIN)/python -m tests.bench.fuzz_readers --seconds 40

# sdist and wheel in dist/, the wheel tried in an empty environment
wheel: $(STAMP)
	$(BIN)/python -m tests.bench.wheel --place out/wheel
	mkdir -p dist && cp out/wheel/dist/* dist/

clean:
	rm -rf demo out site build dist .pytest_cache .mypy_cache .ruff_cache
