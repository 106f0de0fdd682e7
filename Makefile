# make demo      a pick-and-place cycle on the built-in simulator, over a real pseudo-terminal
# make panel     a simulated arm in the browser: make panel [ARM_URL=sim:] [OPTIONS="--port 0"]
# make test      the quick checkers and the quick suite: everything is tested, on few examples
# make test-full all checkers and the whole suite, on all examples; with REST=1 only what `make test` has left out
# make test-all  the test suite on every Python from 3.11 on that this machine has
# make test-minimum  the test suite with the lowest version of everything that pyproject.toml declares
# make docs      the site, in build/site, and what is promised of it; a warning is an error
# make dist      sdist and wheel, in dist, as the package index will take them
# make sbom      what the wheel brings with it, in build/sbom.cdx.json (CycloneDX)
# make format    what ruff can mend
# make sync      writes the blocking classes out of the asynchronous ones again
# make lerobot   the contract tests of integrations/, with LeRobot but without what only its training needs
# make soak      random programs on bad lines, in virtual time: make soak [SEEDS=10000] [FIRST=0] [OF=arm|cell|guards|lost|stops]
# make promises  what the driver promises on dead, slow and lossy lines, at many more moments than make test-full tries
# make fuzz      each fuzz target for a minute: make fuzz [SECONDS=60] [TARGET=parser]

# Tests start many programs, which would compile all that they import each time.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: demo panel sync lerobot test test-full test-all test-minimum check lint types pytest docs dist sbom format clean fuzz promises soak

demo: $(VENV)/.cli
	$(BIN)/python -m dobot_async demo

ARM_URL ?= sim:
OPTIONS ?=

panel: $(VENV)/.panel
	$(BIN)/python -m dobot_async --url '$(ARM_URL)' panel $(OPTIONS)

# Who is ready takes over what others have before them.
PYTEST := -m pytest -n auto --dist worksteal
REST ?=

# What the checkers say is kept back until the tests have ended.
test: $(VENV)/.dev
	@mkdir -p build
	@$(MAKE) --no-print-directory lint >build/check.txt 2>&1 & checks=$$!; \
	$(BIN)/python $(PYTEST); tests=$$?; \
	wait $$checks; checked=$$?; cat build/check.txt; exit $$((tests | checked))

test-full: $(if $(REST),types,check) pytest

check: lint types

# These remember what they have seen.
lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# --verifytypes looks for libraries with the first python of the PATH, and does not see through an editable install.
types: $(VENV)/.dev
	$(BIN)/basedpyright --project pyproject.toml --pythonpath $(BIN)/python
	PYTHONPATH="$(CURDIR)" PATH="$(abspath $(BIN)):$$PATH" $(BIN)/basedpyright --verifytypes dobot_async --ignoreexternal

sync: $(VENV)/.dev
	$(BIN)/python tests/sync/write_sync.py

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# A Python is on the PATH as python3.N, or among pyenv's.
test-all:
	@set -e; for minor in 11 12 13 14 15; do \
	    python=$$(ls -d $${PYENV_ROOT:-$$HOME/.pyenv}/versions/3.$$minor.*/bin/python 2>/dev/null | tail -n 1); \
	    if python3.$$minor -c '' 2>/dev/null; then python=python3.$$minor; fi; \
	    if [ -n "$$python" ]; then \
	        echo "== Python 3.$$minor"; \
	        $(MAKE) --no-print-directory pytest PYTHON="$$python" VENV=.venv-3.$$minor; \
	    fi; \
	done

# What pyproject.toml declares is taken at its lowest, what that needs in turn as pip would.
test-minimum: .venv-minimum/.dev
	.venv-minimum/bin/python $(PYTEST) --full

.venv-minimum/.dev: pyproject.toml
	$(PYTHON) -m venv --clear .venv-minimum
	.venv-minimum/bin/python -m pip install --quiet --disable-pip-version-check uv
	.venv-minimum/bin/uv pip install --quiet --python .venv-minimum/bin/python --resolution lowest-direct --editable '.[dev,fuzz]'
	touch $@

pytest: $(VENV)/.dev
	$(BIN)/python $(PYTEST) $(if $(REST),--rest,--full)

docs: $(VENV)/.dev
	rm -rf build/site
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -b html -d build/doctrees docs build/site
	DOBOT_SITE=build/site DOBOT_REQUIRE_SITE=1 $(BIN)/python -m pytest -q --full tests/docs/test_site.py

dist: $(VENV)/.dev
	rm -rf dist
	$(BIN)/python -m build
	$(BIN)/python -m twine check --strict dist/*

EXTRAS := ble-sim,bridge,cli,draw,pytest,zenoh

sbom: dist
	$(PYTHON) -m venv --clear build/sbom
	build/sbom/bin/python -m pip install --quiet --disable-pip-version-check "$$(ls dist/*.whl)[$(EXTRAS)]"
	$(BIN)/cyclonedx-py environment --pyproject pyproject.toml --output-file build/sbom.cdx.json build/sbom

SEEDS ?= 10000
FIRST ?= 0
OF ?= arm

soak: $(VENV)/.dev
	$(BIN)/python tests/simulation/soak.py --of $(OF) --seeds $(SEEDS) --first $(FIRST)

LEROBOT := 'lerobot>=0.4.4,<0.5'
LEROBOT_NEEDS := 'draccus==0.10.0' 'deepdiff>=7.0.1,<9' 'huggingface-hub>=0.34.2,<0.36' 'jsonlines>=4' 'numpy>=2' termcolor tqdm

lerobot: .venv-lerobot/.lerobot
	DOBOT_REQUIRE_LEROBOT=1 .venv-lerobot/bin/python -m pytest --full tests/test_integrations.py

.venv-lerobot/.lerobot: pyproject.toml
	$(PYTHON) -m venv .venv-lerobot
	.venv-lerobot/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]' $(LEROBOT_NEEDS)
	.venv-lerobot/bin/python -m pip install --quiet --disable-pip-version-check --no-deps $(LEROBOT)
	touch $@

ANSWERS ?= 200000

promises: $(VENV)/.dev
	PROMISES=all $(BIN)/python $(PYTEST) --full tests/promises
	MOMENTS=all $(BIN)/python $(PYTEST) --full tests/fleet/test_past_a_stop.py
	ENGRAVINGS=200 $(BIN)/python $(PYTEST) --full tests/toolpath/test_any_moment.py
	$(BIN)/python -W ignore tests/promises/stale.py --answers $(ANSWERS)
	$(BIN)/python tests/panel/endurance.py --minutes 1

# Guided by coverage if the extra `fuzz` (atheris) is installed.
SECONDS ?= 60
TARGET ?=

fuzz: $(VENV)/.dev
	$(BIN)/python tests/fuzz/fuzz.py --seconds $(SECONDS) $(TARGET)

$(VENV)/.venv:
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.cli: $(VENV)/.venv pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cli]'
	touch $@

$(VENV)/.panel: $(VENV)/.venv pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cli,panel]'
	touch $@ $(VENV)/.cli

$(VENV)/.dev: $(VENV)/.venv pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@ $(VENV)/.cli $(VENV)/.panel

clean:
	rm -rf .venv .venv-minimum .venv-3.* build dist *.egg-info .import_linter_cache .mypy_cache .pytest_cache .ruff_cache .hypothesis
