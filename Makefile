# Everything a person needs: `make run` and `make test`. `make help` lists the rest.
# Nothing is installed outside .venv, but for Debian's chromium when root runs the tests.

VENV := .venv
PY   := $(VENV)/bin/python
RUN  := $(VENV)/.installed-run
DEV  := $(VENV)/.installed-dev
MODEL := $(VENV)/.installed-model
ARGS ?=
WHAT ?= tick
RUNS ?= 1000000

PIP_INSTALL := $(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt

.DEFAULT_GOAL := help
.PHONY: help run test check slow peers peers-env hardware bench robot reference wheel clean browser

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | awk -F '\t' '{printf "  make %-10s%s\n", $$1, $$2}'

run: $(RUN) ## install what is needed and start Flinch (flags: ARGS="--port 8090")
	@$(VENV)/bin/flinch run $(ARGS)

test: check browser ## lint, types, imports and the tests (flags for pytest: ARGS="-k skin")
ifeq ($(strip $(ARGS)),)
	$(PY) -m pytest --ignore tests/browser -n 2 --dist loadfile -q
	$(PY) -m pytest tests/browser # alone: it draws in software and needs the processor
else
	$(PY) -m pytest $(ARGS)
endif

check: $(DEV) ## lint, types and imports only
	$(VENV)/bin/ruff check
	$(VENV)/bin/ruff format --check
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

slow: $(DEV) $(MODEL) browser ## the tests that take minutes
	$(PY) -m pytest -m "slow and not peers and not hardware" $(ARGS)

peers-env: $(DEV) ## the peers to compare with; Open3D, whose pins clash with ours, apart
	$(PIP_INSTALL) -e '.[peers]'
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get install -y -qq libusb-1.0-0 libgl1 libgomp1 libx11-6 >/dev/null; fi # for Open3D
	$(PY) -m venv $(VENV)/peers/open3d
	$(VENV)/peers/open3d/bin/pip install --quiet --disable-pip-version-check open3d==0.20.0

peers: $(DEV) ## the comparisons with other software
	$(PY) -m pytest -m "peers and not hardware" $(ARGS)

hardware: $(DEV) ## the tests that need a real skin or a real arm
	$(PY) -m pytest -m hardware $(ARGS)

.PHONY: fuzz
fuzz: $(DEV) ## fuzz the decoders of serial skins with a million streams (RUNS=1000000)
	$(PIP_INSTALL) -e '.[fuzz]'
	$(PY) -m tests.fuzz_wire -runs=$(RUNS) -max_len=1500 .artifacts/fuzz

bench: $(RUN) ## measure this machine (WHAT=tick, perception, control, guard, serial or peers; ARGS="--json")
	@$(VENV)/bin/flinch bench $(WHAT) $(ARGS)

robot: $(MODEL) ## model the built-in robots anew and write their meshes
	$(PY) robots/ur10e/model.py
	$(PY) robots/ur10e/skin/covers.py
	$(PY) robots/ur10e/tools/screwdriver.py
	$(PY) robots/swan7/model.py

reference: $(RUN) ## renew the tables of keys and the drawing of robots/README.md
	$(PY) robots/reference.py

.PHONY: gallery
gallery: $(DEV) browser ## record and export the paper's scenes; renew the README's pictures of them
	$(VENV)/bin/flinch gallery .artifacts/gallery --paper
	$(PY) -m tests.gallery_pictures .artifacts/gallery static_assets/gallery

wheel: $(DEV) ## build dist/flinch-*.whl, robots and scenes included
	$(PY) -m build --wheel --no-isolation

clean: ## remove builds, caches and artefacts; .venv stays
	rm -rf build dist .artifacts .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache *.egg-info
	find app tests robots -name __pycache__ -type d -prune -exec rm -rf {} +

# A python that only answers with an error (a version manager's shim) is passed over, as is
# one without venv or pip (Debian ships these apart).
$(PY):
	@for p in python3.13 python3.12 python3.11 python3; do \
	  if $$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	    echo "Creating $(VENV) with $$($$p --version)"; \
	    exec $$p -m venv --clear $(VENV); \
	  fi; \
	done; \
	echo "make: no Python 3.11 or newer with venv found; install one (Debian: apt install python3-venv)" >&2; \
	exit 1

$(RUN): pyproject.toml constraints.txt $(PY)
	@echo "Installing Flinch into $(VENV) (a minute or two, only when the requirements change)"
	@$(PIP_INSTALL) -e .
	@$(VENV)/bin/flinch kernels
	@touch $@

$(DEV): pyproject.toml constraints.txt $(PY)
	@echo "Installing Flinch and its tools into $(VENV) (a minute or two, only when the requirements change)"
	@$(PIP_INSTALL) -e '.[dev]'
	@$(VENV)/bin/flinch kernels
	@touch $(RUN) $@

$(MODEL): pyproject.toml constraints.txt $(PY)
	@echo "Installing what the robots' modelling scripts need into $(VENV)"
	@$(PIP_INSTALL) -e '.[model]'
	@touch $@

# The browser's tests skip without one, but fail where CI=true: tests/conftest.py.
browser: $(DEV) ## find or install a Chromium for the tests that drive one
	@for b in chromium chromium-browser google-chrome; do \
	  if command -v $$b >/dev/null; then exit 0; fi; \
	done; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  echo "Installing Debian's chromium for the browser's tests"; \
	  apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null && exit 0; \
	fi; \
	$(PY) -m playwright install chromium || \
	echo "make: no Chromium for the browser's tests; install the package chromium and run again" >&2
