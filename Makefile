# Everything is set up here: `make demo` and `make test` need only Python >= 3.11 and make.
PYTHON ?= python3
# several test processes with several BLAS threads each get in each other's way
export OMP_NUM_THREADS ?= 1
# tests are rewritten and modules compiled once, not by each process, whatever the shell says
export PYTHONDONTWRITEBYTECODE =
VENV ?= .venv
# all of them, or those that are named
TESTS ?=
LOWEST = $(VENV)-lowest
ifeq ($(OS),Windows_NT)
SCRIPTS = Scripts
else
SCRIPTS = bin
endif
BIN = $(VENV)/$(SCRIPTS)

.PHONY: demo test verify docs paper package lowest lint bench bench-all clean

# what runs the package alone
$(VENV)/.installed: pyproject.toml
	@echo "installing slipstick and what it runs on into $(VENV)/ (0.7 GB)"
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --upgrade "pip>=25.1"
	$(BIN)/python -m pip install -q -e .
	@$(BIN)/python -c "open('$(VENV)/.installed', 'w').close()"

# and the tools of those who develop it
$(VENV)/.ready: $(VENV)/.installed
	@echo "installing the tools for tests, lint and type checks into $(VENV)/"
	$(BIN)/python -m pip install -q -e . --group dev
	@$(BIN)/python -c "open('$(VENV)/.ready', 'w').close()"

demo: $(VENV)/.installed
	$(BIN)/python examples/demo.py

test: $(VENV)/.ready
	@echo "about 10 000 tests, 6 to 12 minutes on 2 cores"
	$(BIN)/python -m pytest -n 2 $(TESTS)

# all of the verification that has not passed yet on this commit, JOBS=2 pieces at a time, or the pieces named in TESTS
verify: $(VENV)/.ready $(VENV)/.docs $(VENV)/.browser
	VENV=$(VENV) LOWEST=$(LOWEST) $(BIN)/python .ci/verify.py $(TESTS)

# the site, in build/site; warnings are errors
docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/site

$(VENV)/.docs: $(VENV)/.ready
	$(BIN)/python -m pip install -q --group docs
	$(BIN)/python -c "open('$(VENV)/.docs', 'w').close()"

$(VENV)/.browser: $(VENV)/.ready
	$(BIN)/python -m pip install -q --group browser
	$(BIN)/python -c "open('$(VENV)/.browser', 'w').close()"

# the paper with its figure and citations, in build/paper/paper.html; needs pandoc
paper:
	$(PYTHON) -c "import os, shutil; os.makedirs('build/paper', exist_ok=True); shutil.copy('paper/figure.png', 'build/paper')"
	cd paper && pandoc --fail-if-warnings --standalone --citeproc --mathml --lua-filter figures.lua paper.md -o ../build/paper/paper.html

# what is published, in dist/, checked
package: $(VENV)/.ready
	$(BIN)/python -m pip install -q --group release
	$(PYTHON) -c "import shutil; shutil.rmtree('dist', ignore_errors=True)"
	$(BIN)/python -m build -q
	$(BIN)/python -m twine check --strict dist/*
	$(BIN)/python .ci/package.py

# the fast tests with every dependency at the lower bound that pyproject.toml gives it
lowest: $(LOWEST)/.ready
	$(LOWEST)/$(SCRIPTS)/python -m pytest -n 2

$(LOWEST)/.ready: pyproject.toml .ci/lowest.py
	$(PYTHON) -m venv $(LOWEST)
	$(LOWEST)/$(SCRIPTS)/python -m pip install -q --upgrade "pip>=25.1"
	$(LOWEST)/$(SCRIPTS)/python .ci/lowest.py > $(LOWEST)/constraints.txt
	$(LOWEST)/$(SCRIPTS)/python -m pip install -q --only-binary :all: -c $(LOWEST)/constraints.txt -e . --group dev
	$(LOWEST)/$(SCRIPTS)/python -c "open('$(LOWEST)/.ready', 'w').close()"

lint: $(VENV)/.ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -q -m verify tests/type_checks

# a few minutes, kept in benchmarks/results; with PYHARM_PYTHON=... beside pyHarm (see benchmarks/against_pyharm.py)
bench: $(VENV)/.ready
	$(BIN)/python benchmarks/run.py

# and the large models: about half an hour and 8 GB
bench-all: $(VENV)/.ready
	$(BIN)/python benchmarks/run.py --all

clean:
	$(PYTHON) -c "import shutil; [shutil.rmtree(d, ignore_errors=True) for d in ('$(VENV)', '$(LOWEST)', 'demo-results', 'build', 'dist')]"
