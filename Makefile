PYTHON ?= python3
BIN := .venv/bin
OUT ?= out
NODE_CLIENTS := tests/interop/node_modules/.package-lock.json
WEB_PLAYER := players/web/node_modules/.package-lock.json
WEB_BUILT := players/web/dist/sample.avatar
WEB_RECIPES := players/web/examples/node_modules/.package-lock.json

# Worker processes of pytest, each of about 2 GB. Tests are stolen from the end of another worker's list: files stay
# together, so that what a module or a session makes is made once a worker.
WORKERS ?= 2
PYTEST = $(BIN)/pytest --numprocesses $(WORKERS) --dist worksteal --durations=20

# `make check`: the rules of the floors, the formats, the stages, body models, operations, the goldens of bundles.
CORE := tests/test_floors.py tests/test_released.py tests/schema tests/conformance/test_bundles.py \
	tests/runtime/stages tests/runtime/codec tests/runtime/checks tests/runtime/test_bundle.py \
	tests/exporter/formats tests/exporter/bodies tests/exporter/driving tests/runtime/driving tests/exporter/ops

# Compiled modules are kept, since the tests start about 200 processes.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo view unity check test test-more players godot fuzz bench docs dist size clean

demo: .venv/installed
	$(BIN)/python -m samples.demo $(OUT)/demo

# The sample in a browser.
view: .venv/installed
	$(BIN)/python -m avatar_export view samples/trained/head_blendshapes

# A Unity project for work on the package: hand-written files are links into this checkout.
unity: .venv/installed
	$(BIN)/python -m tools.unity_project $(OUT)/unity

check: .venv/tested
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --quiet --check .
	$(BIN)/mypy
	$(PYTEST) --quiet $(CORE)

test: .venv/tested $(NODE_CLIENTS) $(WEB_BUILT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(PYTEST)

# The site, every documented command, the numbers as other processors and Python versions compute them, and Godot where
# it can be had; where it cannot, the last line says so.
test-more: .venv/tested $(NODE_CLIENTS) $(WEB_RECIPES) docs
	$(PYTEST) -m "more and not godot"
	$(BIN)/python -m tools.machines
	if $(BIN)/python -m tools.godot.fetch; then $(GODOT_TESTS); fi

# What the players draw of every sample and every avatar, on every backend and in every browser that runs here.
players: .venv/tested $(WEB_PLAYER)
	sh .ci/packages browsers
	$(PYTEST) -m players

# The add-on in the engine. It is fetched into .cache/godot (0.2 GB of packages, 0.6 GB unpacked; AVATAR_GODOT_DIR names
# another folder, GODOT another engine). `make clean` leaves it there.
GODOT_TESTS = $(BIN)/python -m tools.godot.build linux.$(shell uname -m | sed s/aarch64/arm64/) && \
	$(PYTEST) -m godot tests/players/godot
godot: .venv/tested
	$(BIN)/python -m tools.godot.fetch
	$(GODOT_TESTS)

# A million hostile files, always the same ones; 300,000 hostile packs, of which all readers must say the same; ten million
# of the native player's loader, guided by what they reach; commands that are killed or lack disk, streams or memory; and
# twenty times as many made-up inputs as the tests ask for, other ones on every run.
INPUTS ?= 1000000
NATIVE_INPUTS ?= 10000000
FAULTS ?= 100
FUZZ ?= 20
fuzz: .venv/tested
	$(BIN)/python -m tools.fuzz --inputs $(INPUTS) --workers $(WORKERS)
	$(BIN)/python -m tools.fuzz.readers
	$(BIN)/python -m tools.fuzz.native --runs $(NATIVE_INPUTS)
	$(BIN)/python -m tools.fuzz.faults --each $(FAULTS)
	AVATAR_FUZZ=$(FUZZ) $(PYTEST) -m hypothesis

# The site, into build/docs. It shows the help of every command, also of those that need torch.
docs: .venv/documented $(WEB_BUILT)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

bench: .venv/tested
	$(BIN)/python -m bench

# Wheels, sdists, and an archive of each player.
dist: .venv/tested $(WEB_BUILT)
	$(BIN)/python -m tools.dist dist

# Tracked files and lines by kind, pages and words.
size:
	@$(PYTHON) -m tools.size

clean:
	rm -rf .venv .venv-3.* $(OUT) build/docs dist tests/interop/node_modules

.venv/installed: pyproject.toml
	sh .ci/packages
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

# slangtorch is wanted for the slangc inside it alone, not for what it does with torch.
.venv/tested: .venv/installed .ci/packages
	sh .ci/packages tests
	$(BIN)/python -m pip install --quiet --group dev
	$(BIN)/python -m pip install --quiet --no-deps slangtorch==1.3.22
	$(BIN)/python -m tools.compile_kernels
	$(BIN)/python -m tools.zig
	-$(BIN)/python -m tools.windows.prepare
	touch $@

.venv/documented: .venv/tested
	$(BIN)/python -m pip install --quiet --group docs
	touch $@

$(WEB_PLAYER): players/web/package-lock.json | .venv/tested
	npm ci --prefix players/web --ignore-scripts --loglevel=error
	touch $@

$(WEB_BUILT): $(WEB_PLAYER) $(shell find players/web/src players/web/*.mjs players/web/tsconfig.json -type f)
	node players/web/build.mjs package
	$(BIN)/python -m tools.web_sample $@

$(WEB_RECIPES): players/web/examples/package-lock.json | $(WEB_BUILT)
	npm ci --prefix players/web/examples --ignore-scripts --loglevel=error
	touch $@

$(NODE_CLIENTS): tests/interop/package-lock.json | .venv/tested
	npm ci --prefix tests/interop --ignore-scripts --loglevel=error
	touch $@
