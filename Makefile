# make run: install and fly the flagship; make test: install and test; make lint; make benchmark.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
SCENARIO ?= efremov-nonlocal

.PHONY: run test test-slow lint benchmark browser clean

run: $(VENV)/installed
	$(BIN)/spacecraft-sim run $(SCENARIO)

test: $(VENV)/installed-dev browser
	$(BIN)/python -m pytest -n auto -m "not slow"

# Tests of report.html open it in Chromium, and are skipped without it.
browser:
	@command -v chromium >/dev/null || (test $$(id -u) = 0 && command -v apt-get >/dev/null && apt-get install -qq -y --no-install-recommends chromium >/dev/null 2>&1) || echo "no chromium: tests of report.html in a browser are skipped"

test-slow: $(VENV)/installed-dev
	$(BIN)/python -m pytest -n auto -m slow

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

benchmark: $(VENV)/installed
	$(BIN)/python scripts/benchmark.py

clean:
	rm -rf $(VENV) build dist

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	touch $@

$(VENV)/installed-dev: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	touch $@
