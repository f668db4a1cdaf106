# Two commands are all the set-up: `make demo` and `make test`. Each makes .venv on first use.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# What a machine can check of the house without running it.
HOUSE := tests/test_architecture.py tests/test_purity.py tests/test_sizes.py tests/test_references.py tests/test_public_names.py
QUICK := not browser and not wheel and not integration and not field and not system
SHELL := /bin/bash
# pytest with these arguments; if tests failed (1), those once more, one after the other. (5: of the
# tests that ARGS names, none is of that kind.)
twice = $(BIN)/pytest $(1); code=$$?; \
	if [ $$code -eq 1 ]; then echo "== failed above: once more, alone"; \
	$(BIN)/pytest $(1) -n 0 --last-failed --last-failed-no-failures none; code=$$?; fi; \
	[ $$code -eq 0 ] || [ $$code -eq 5 ]
# Commands of a virtual environment that the user has activated must not leak into ours.
unexport PYTHONPATH PYTHONHOME

.PHONY: demo test check bench soak format docs picture figures clean system install browser wheel test-field test-system wheels test-arm64

demo: $(STAMP)
	$(BIN)/rhot demo $(ARGS)

# Everything but the suites that need more than Python or minutes: `make browser`, `make wheel`,
# `make test-field`, `make test-system`. What starts the whole rig's processes has the machine to itself.
# Of the others' time a third is waiting, for messages and for processes: three of them share two
# cores. Messages on a machine that is too busy may be lost: a test that failed beside others runs
# once more alone, both outcomes are printed, and the second counts.
test: $(STAMP)
	$(call twice,-n 3 --dist loadfile --durations=10 -m "$(QUICK)" $(ARGS))
	$(call twice,--durations=10 -m integration $(ARGS))

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest -q $(HOUSE)

bench: $(STAMP)
	@for script in $(filter-out benchmarks/soak%,$(wildcard benchmarks/*.py)); do echo "== $$script"; $(BIN)/python $$script || exit 1; done

# A simulated rig under random faults: memory, latency, recoveries; writes soak.md, soak.png and soak.json.
MINUTES ?= 30
soak: $(STAMP)
	$(BIN)/python benchmarks/soak.py --minutes $(MINUTES) $(ARGS)

browser: $(STAMP)
	@command -v chromium >/dev/null || { echo "Chromium is missing: sudo apt install chromium"; exit 1; }
	$(BIN)/pip install --disable-pip-version-check --quiet -e '.[browser]'
	$(call twice,-q --durations=10 tests/browser $(ARGS))

# The built wheel in new environments, with each extra alone; takes minutes and downloads packages.
wheel: $(STAMP)
	$(call twice,-q --durations=10 -m wheel tests/wheel tests/deploy $(ARGS))

# All packages of an installation without a network: dist/wheels/master (this kind of machine) and pi.
wheels: $(STAMP)
	$(BIN)/python -m testing.collect_wheels $(ARGS)

# install.sh and a tracker on an emulated 64-bit ARM Debian; as root, 10 to 20 minutes. Not in CI.
test-arm64: $(STAMP)
	$(BIN)/python -m testing.collect_wheels pi
	tests/deploy/arm64.sh

# A rig as it is used: planted faults and what `rhot doctor` says of them, floods on a secured bus,
# two Pis as network namespaces, every command of docs/guide/operations.md, every calibration step
# from Start to Save on a simulated rig. Twelve minutes.
test-field: $(STAMP)
	$(call twice,-q --durations=10 -m field tests $(ARGS))

# A master and two Pis as containers with systemd, installed by deploy/install.sh; faults are planted
# and a table is printed (and written to build/system.json). Needs root and systemd-container; the
# first run compiles kernels for minutes, later ones find them in build/hosts.
test-system: $(STAMP)
	$(call twice,-q tests/system $(ARGS))

# The generated reference pages, and the tables of figures from docs/figures/*.json.
docs: $(STAMP)
	$(BIN)/python -m docs.generate

# docs/demo.png, which README opens with: the page of the demo while the hand holds the cup.
picture: $(STAMP)
	@command -v chromium >/dev/null || { echo "Chromium is missing: sudo apt install chromium"; exit 1; }
	$(BIN)/pip install --disable-pip-version-check --quiet -e '.[browser]'
	$(BIN)/python -m docs.generate.demo_picture

# Runs the benchmarks that the pages quote (docs/notes/README.md), then renders the pages.
figures: $(STAMP)
	$(BIN)/python -m docs.generate.run_figures $(ARGS)
	$(BIN)/python -m docs.generate

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

install: $(STAMP)

# Names what is missing and the command that installs it, before pip fails with a page of text.
system:
	@command -v $(PYTHON) >/dev/null || { echo "python3 is missing: sudo apt install python3 python3-venv"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "rhot needs Python 3.11 or newer, this is $$($(PYTHON) --version); on Debian 12+ and Raspberry Pi OS (bookworm): sudo apt install python3 python3-venv, elsewhere: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python's venv is missing: sudo apt install python3-venv"; exit 1; }
	@$(PYTHON) -c 'import struct, sys; sys.exit(struct.calcsize("P") != 8)' || { echo "rhot needs a 64-bit system (there are no 32-bit packages of OpenCV and Zenoh): install the 64-bit Raspberry Pi OS"; exit 1; }

# Not services/..., which would install anew with every change: only what is compiled then.
$(STAMP): pyproject.toml hatch_build.py $(wildcard services/pi_tracker/compiled/*.[ch]) | system
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --disable-pip-version-check --quiet -e '.[dev]'
	$(BIN)/python -c 'from services.pi_tracker.compiled.library import state; print("markers are measured", state)'
	$(BIN)/rhot warm
	@touch $@

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache
