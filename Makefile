# make        set up .venv, then derive, emit, compile and verify the default hand
# make test   all tests              make lint   ruff, mypy, layers
# make check  is generated/ fresh?   make bench  us and the peers, side by side
# make report a page with the hand, which moves, its figures, those of the source computed again, all proofs: build/report/index.html
# make docs   the documentation site with its gallery: build/site/index.html
# make torture  hours: 10 000 mutated hand files, 200 random hands, 10 000 damaged caches, 200 kills
# make firmware  every kernel on every target: equal bits, committed figures (ACCEPT=1 writes them, ALL=1: more, QUICK=1: what CI runs)
# make analysis  gcc -fanalyzer, clang-tidy and cppcheck: no finding without a reason
# make mutants  change one operator or constant of csrc/ at a time (COUNT=60: some of them); half an hour for all
# make test-hands  published hands: imported, one finger of each proved, compared with MuJoCo and Pinocchio (ACCEPT=1: new table, QUICK=1: what CI runs)
# make wheel  the wheel with the compiled hand, and the sdist, in dist/: minutes the first time, for all batches
# make clean  remove what make made (generated/ stays: it is checked in)

PYTHON ?= python3
BIN := .venv/bin
export AWIWI_GEN_CACHE ?= $(CURDIR)/.cache

all: .venv/installed
	@$(BIN)/awiwi-gen generate --verify

.venv/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "awiwi_gen needs Python 3.11 or newer")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

test: .venv/installed .venv-web/installed
	PYTHONPATH=$(CURDIR)/.venv-web $(BIN)/python -m pytest

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest tests/test_layers.py

torture: .venv/installed
	$(BIN)/python tests/mutations.py 10000
	AWIWI_TORTURE=25 $(BIN)/python -m pytest tests/test_cache.py tests/test_system_errors.py tests/test_editing.py \
	  tests/test_batches.py
	$(BIN)/python tests/torture_hands.py

check: .venv/installed
	@$(BIN)/awiwi-gen check

report: .venv/installed .venv-web/installed
	@PYTHONPATH=$(CURDIR)/.venv-web $(BIN)/awiwi-gen report

docs: all .venv-docs/installed
	@PYTHONPATH=.venv-docs $(BIN)/python docs/site/build.py

bench: .venv/installed .venv-bench/installed
	@$(BIN)/python -m bench

firmware: .venv/installed
	@$(BIN)/python -m tests.targets $(if $(ACCEPT),--accept) $(if $(ALL),--all) $(if $(QUICK),--quick)

analysis: .venv/installed
	@$(BIN)/python -m tests.targets.analysis

mutants: .venv/installed
	@$(BIN)/python -m tests.targets.mutants $(if $(COUNT),--count $(COUNT))

test-hands: .venv/installed .venv-hands/installed
	@PYTHONPATH="$$(echo .venv-hands .venv-hands/cmeel.prefix/lib/python3*/site-packages | tr ' ' :)" \
	  $(BIN)/python -m tests.hands $(if $(ONLY),--only "$(ONLY)") $(if $(QUICK),--quick) $(if $(ACCEPT),--accept)

# MuJoCo and Pinocchio beside .venv, whose NumPy they use; Pinocchio lies in a prefix of its own.
.venv-hands/installed: tests/hands/requirements.lock .venv/installed
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv-hands --requirement $<
	@touch $@

# Sphinx and its extensions beside .venv, as only the site needs them.
.venv-docs/installed: docs/requirements.lock .venv/installed
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv-docs --requirement $<
	@touch $@

# The compiler to WebAssembly beside .venv, as only the report and its tests need it.
.venv-web/installed: tests/browser/requirements.lock .venv/installed
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target .venv-web --requirement $<
	@touch $@

# The peers live in an environment of their own. Where one cannot be installed, the others are compared.
.venv-bench/installed: bench/requirements.lock
	$(PYTHON) -m venv .venv-bench
	@.venv-bench/bin/pip install --quiet --disable-pip-version-check -r $< \
	  || for peer in $$(cat $<); do .venv-bench/bin/pip install --quiet --disable-pip-version-check --no-deps $$peer \
	  || echo "bench: $$peer cannot be installed here"; done
	@touch $@

wheel: .venv/installed
	@$(BIN)/python -m hatchling build

clean:
	rm -rf .venv .venv-bench .venv-hands .venv-docs .venv-web .cache build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.PHONY: all docs wheel test test-hands lint torture check report bench firmware analysis mutants clean
