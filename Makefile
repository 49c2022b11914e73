# Two commands do all set-up: `make run` (the main scenario and its report), `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/installed
FLOORS := build/floors
# set in many containers; every process that the tests start would read the sources again
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test test-floors test-processors mutants lint bench bench-precision gallery docs wheels lock clean torture

run: $(STAMP)
	$(BIN)/torquer run examples/chibis_m_detumble.toml

test: $(STAMP)
	$(BIN)/python -m pytest -n auto --dist loadfile

# the lowest versions that pyproject.toml allows (on the lowest Python that you have): a newcomer's
# first commands, and the tests of compiling
test-floors: $(FLOORS)/installed
	cd $(FLOORS) && bin/python $(CURDIR)/examples/quickstart.py
	$(FLOORS)/bin/torquer campaign examples/tip_off_campaign.toml --runs 4 --overwrite --out $(FLOORS)/runs/campaign
	$(FLOORS)/bin/torquer export c examples/chibis_m_detumble.toml --out $(FLOORS)/runs/export
	$(FLOORS)/bin/python -m pytest tests/compile

# the suite once for each kind of processor that OpenBLAS, NumPy and Numba can be made to serve
test-processors: $(STAMP)
	$(BIN)/python tests/processors.py

# whether the tests notice small mistakes in the kernels: an hour or more; it goes on where it ended
mutants: $(STAMP)
	$(BIN)/python tests/mutants.py

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python docs/style.py

bench: $(STAMP)
	$(BIN)/python benchmarks/run.py
	$(BIN)/python docs/generate.py peers.md
	$(BIN)/python benchmarks/lanes.py
	$(BIN)/python benchmarks/campaign_peers.py
	$(BIN)/python benchmarks/flight_software.py
	$(BIN)/python benchmarks/ground.py

# cost and error of all integrators; heyoka and Basilisk (bsk) only where they are installed
bench-precision: $(STAMP)
	$(BIN)/python benchmarks/precision.py

# every published figure and table recomputed, with the pages of docs/gallery; then the slow tests
gallery: $(STAMP)
	$(BIN)/torquer gallery all --docs docs/gallery
	$(BIN)/python -m pytest -m slow --ignore tests/reliability

# signals, damaged files and random scenarios by the hundreds: about half an hour
torture: $(STAMP)
	$(BIN)/python -m pytest -m slow tests/reliability

# what users install: dist/torquer-*.whl, and dist/torquer_kernels-*.whl, compiled for this platform
wheels: $(STAMP)
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	$(BIN)/python packaging/kernels_wheel.py --out dist

# the site of all pages, with search and formulas: build/docs/index.html
docs: $(VENV)/docs
	$(BIN)/sphinx-build -W --keep-going -q -j auto -c docs/site . build/docs

# pin all dependencies again (needs `uv`)
PIN := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
  --no-annotate --no-header --no-emit-index-url
lock:
	$(PIN) --extra test -o requirements.lock
	$(PIN) --extra docs --constraint requirements.lock -o requirements-docs.lock

clean:
	rm -rf $(VENV) runs build benchmarks/build

$(STAMP): pyproject.toml requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(FLOORS)/installed: pyproject.toml packaging/floors.py
	$(PYTHON) -m venv --clear $(FLOORS)
	$(PYTHON) packaging/floors.py test nrlmsis symbolic dask can > $(FLOORS)/pins.txt
	$(FLOORS)/bin/python -m pip install --quiet -r $(FLOORS)/pins.txt
	$(FLOORS)/bin/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/docs: $(STAMP) requirements-docs.lock
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-docs.lock
	touch $@
