# `make demo` and `make test` are all that a newcomer needs; `make help` lists the rest.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: lint-rust lint-python help demo samples test test-extended test-extended-python test-extended-rust test-all lint bench trust fuzz soak docs wheels clean prerequisites

PYTHON ?= python3
SECONDS ?= 3600
HOURS ?= 24
IMAGES ?= 100000
WORKERS ?= auto
SOME ?=
CARGO ?= cargo
BIN := .venv/bin
# What the scripts share, and what has a target of its own.
NO_BENCHES := benches/scenes.py benches/track/sequences.py benches/servo/servo_table.py \
    $(wildcard benches/trust/*.py)
# A file's tests stay together, as they share what is drawn for them; files that take long go first,
# in the order of tests/fixtures/tiers.py, so that no worker waits for another in the end.
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --maxprocesses 4 --dist loadfile \
	--no-loadscope-reorder

# One interpreter for every build: a change of it would rebuild the binding.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
export VIRTUAL_ENV := $(CURDIR)/.venv
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1
unexport CONDA_PREFIX PYTHONHOME

RUST_FILES := $(shell find crates -type f \( -name '*.rs' -o -name Cargo.toml \)) \
	Cargo.toml $(wildcard Cargo.lock)
RUST_NEEDED := $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

demo: .venv/.package ## let a simulated arm meet an object, model it, and follow it; make a video and a report
	@mkdir -p out
	$(BIN)/servoid servo --object bottle --path sine:0.1@8s --seconds 12 --out out/run
	@echo "Open out/run/report.html and out/run/servo.mp4"

samples: .venv/.package ## draw captures to try things on; model one and track the other
	@mkdir -p out
	@test -e out/sample/capture.toml || $(BIN)/servoid sample out/sample
	$(BIN)/servoid model out/sample --views ::2 --out out/body.json --report out/report
	@test -e out/moving/capture.toml || \
	  $(BIN)/servoid sample out/moving --moving --size small --count 60 --occluder
	$(BIN)/servoid track out/moving --out out/poses.csv --video out/track.mp4

# The binding is left out of `cargo test`: its tests are the Python ones, and linking
# it as a program would need a Python built as a shared library.
test: .venv/.package ## run the laws, and each command once; all that a change needs at first
	$(CARGO) test --workspace --exclude servoid-py
	$(PYTEST) -m 'not extended'

test-extended: test-extended-python test-extended-rust ## run what `make test` leaves out: long laws, studies, pages, faults, more seeds

# SOME may say which: folders, or `--ignore=` and a folder.
test-extended-python: .venv/.package
	$(strip $(PYTEST) -m extended $(SOME))

test-extended-rust:
	SERVOID_FUZZ_SECONDS=30 $(CARGO) test -p servoid --test fuzz

test-all: test test-extended ## run every test, of Rust and of Python

lint: lint-rust lint-python ## check formatting, warnings, types, and the stub of the native module

lint-rust: .venv/.tools
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS='-D warnings' $(CARGO) doc -q -p servoid --no-deps

lint-python: .venv/.package
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/basedpyright
	$(BIN)/python -m mypy.stubtest servoid._native

bench: .venv/.package ## measure speed
	$(CARGO) bench -p servoid
	@for script in $(filter-out $(NO_BENCHES),$(wildcard benches/*.py benches/*/*.py)); do echo "$$script"; $(BIN)/python "$$script"; done

trust: .venv/.package ## measure how far the tracker's words can be trusted; takes hours
	$(BIN)/python benches/trust/trust.py

fuzz: .venv/.package ## throw damaged input at all that reads and at the core, for SECONDS (an hour) each
	$(BIN)/python -m fuzz.run --seconds $(SECONDS)
	SERVOID_FUZZ_SECONDS=$(SECONDS) $(CARGO) test -p servoid --test fuzz -- --nocapture

soak: .venv/.package ## track IMAGES (100000) and servo for HOURS (24) simulated while cameras fail at random
	$(BIN)/python -m fuzz.soak --hours $(HOURS) --images $(IMAGES)

docs: .venv/.package .venv/.docs ## build the documentation in docs/_build
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build
	@! grep -rlE --include='*.html' '<(script|link|img)[^>]*(src|href)="(https?:)?//' docs/_build || \
	  { echo "These pages load files from a network; put the files into docs/_static." >&2; false; }
	@echo "The documentation is in docs/_build/index.html"

wheels: .venv/.wheels | prerequisites ## build the wheels for Linux, x86_64 and aarch64, into dist, and check them
	$(BIN)/python -m wheels.build

clean: ## remove what these targets made
	rm -rf .venv docs/_build out/sample out/report out/body.json build dist
	rm -rf out/run out/moving out/poses.csv out/track.mp4
	rm -rf .pytest_cache .ruff_cache .mypy_cache .hypothesis
	rm -f python/servoid/_native*.so
	find python experiments tests docs examples benches fuzz wheels -type d -name __pycache__ -prune -exec rm -rf {} +
	rm -rf target fuzz/found

# What is missing is told all at once, not one thing after another.
prerequisites:
	@missing=(); \
	tell() { missing+=("$$1"); }; \
	if ! command -v $(PYTHON) >/dev/null; then \
	  tell "Python is missing: install Python 3.10 or newer, or name one with PYTHON=..."; \
	elif ! $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))'; then \
	  tell "$$($(PYTHON) --version) is too old: servoid needs 3.10 or newer; name one with PYTHON=..."; \
	elif ! $(PYTHON) -c 'import ensurepip, venv' 2>/dev/null; then \
	  tell "Python cannot make virtual environments: install its venv module (Debian: python3-venv)"; \
	fi; \
	if ! found=$$($(CARGO) --version 2>/dev/null | awk '{ print $$2 }') || [ -z "$$found" ]; then \
	  tell "Rust is missing: install Rust $(RUST_NEEDED) or newer with rustup"; \
	elif ! printf '%s\n' "$(RUST_NEEDED)" "$$found" | sort -V -C; then \
	  tell "Rust $$found is too old: servoid needs $(RUST_NEEDED) or newer; try 'rustup update'"; \
	fi; \
	if ! command -v cc >/dev/null; then \
	  tell "A C compiler is missing, which Rust links with: install one (Debian: build-essential)"; \
	fi; \
	if [ $${#missing[@]} -gt 0 ]; then printf '%s\n' "$${missing[@]}" >&2; exit 1; fi

.venv/.tools: pyproject.toml | prerequisites
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install -q --upgrade 'pip>=25.1' 'maturin>=1.9,<2' 'flit_core>=3.11,<5'
	$(BIN)/python -m pip install -q --group dev
	@touch $@

.venv/.package: .venv/.tools $(RUST_FILES) experiments/pyproject.toml | prerequisites
	$(BIN)/maturin develop --release --extras batch,view,exchange,servo,sim
	$(BIN)/python -m pip install -q --no-build-isolation --editable experiments
	@touch $@

.venv/.wheels: .venv/.tools
	$(BIN)/python -m pip install -q --group wheels
	@touch $@

.venv/.docs: .venv/.tools
	$(BIN)/python -m pip install -q --group docs
	@touch $@
