PYTHON ?= python3
BIN := .venv/bin
OUT ?= out
NODE_CLIENTS := tests/interop/node_modules/.package-lock.json

.PHONY: demo test bench clean

demo: .venv/installed
	$(BIN)/python -m samples.demo $(OUT)/demo

test: .venv/tested $(NODE_CLIENTS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest

bench: .venv/tested
	$(BIN)/python -m tests.bench

clean:
	rm -rf .venv $(OUT) tests/interop/node_modules

.venv/installed: pyproject.toml
	sh .ci/packages
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

.venv/tested: .venv/installed .ci/packages
	sh .ci/packages tests
	$(BIN)/python -m pip install --quiet --group dev
	touch $@

$(NODE_CLIENTS): tests/interop/package-lock.json | .venv/tested
	npm ci --prefix tests/interop --ignore-scripts --loglevel=error
	touch $@
