PYTHON ?= python3
BIN := .venv/bin
OUT ?= out

.PHONY: demo test bench clean

demo: .venv/installed
	$(BIN)/python -m samples.demo $(OUT)/demo

test: .venv/tested
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest

bench: .venv/tested
	$(BIN)/python -m tests.bench

clean:
	rm -rf .venv $(OUT)

.venv/installed: pyproject.toml
	sh .ci/packages
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

.venv/tested: .venv/installed
	$(BIN)/python -m pip install --quiet --group dev
	touch $@
