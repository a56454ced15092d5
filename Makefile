# A Python of 3.10 to 3.13 (those that requirements.lock serves), e.g. `make install PYTHON=python3.12`.
PYTHON ?= python3
# Passed through to the command a target runs, e.g. `make test ARGS="-k payoff"`.
ARGS ?=

CAMPAIGN := campaigns/paper_merge.toml
BIN := .venv/bin
# A process per core, at most four: tests start campaigns that take several cores themselves. `ARGS="-n 0"` is one process.
PYTEST := $(BIN)/pytest -n auto --maxprocesses 4 --dist worksteal
INSTALLED := .venv/installed
# uv reads none of pip's settings: a folder of wheels that is named to pip serves uv too.
ifdef PIP_FIND_LINKS
export UV_FIND_LINKS ?= $(PIP_FIND_LINKS)
endif

.DEFAULT_GOAL := help
.PHONY: help install demo campaign quick test test-release test-esmini test-commonroad test-ros2 wheel coverage bench publish docs check lock clean

help: ## list the targets
	@echo "make TARGET [ARGS='...'] [PYTHON=python3.x]"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' Makefile | while IFS='|' read -r target text; do \
	    printf '%-15s%s\n' "$$target" "$$text"; done

install: $(INSTALLED) ## set up .venv from requirements.lock (again only when it or pyproject.toml changes)

demo: install ## verify the figures in a few minutes: the campaign's games, played by the shipped policies
	$(BIN)/harness demo $(ARGS)

campaign: install ## run the paper's campaign: harness campaign campaigns/paper_merge.toml
	$(BIN)/harness campaign $(CAMPAIGN) $(ARGS) || test $$? -eq 3 # a bound is not kept: the report says which

quick: install ## the same campaign with a budget of minutes: every stage, fewer steps
	$(BIN)/harness campaign $(CAMPAIGN) --quick $(ARGS) || test $$? -eq 3

test: install ## run the tests that each change must pass; `make test ARGS="-k payoff"` runs some of them
	$(PYTEST) -m "not slow" $(ARGS)

test-release: install ## run every test: before a release; ARGS names those of what a change is about
	$(PYTEST) $(ARGS)

test-esmini: install ## run the tests with esmini and its maps: make test-esmini ESMINI=/path/to/bin/esmini
	HARNESS_REQUIRE_ESMINI=1 ESMINI="$(ESMINI)" $(BIN)/pytest -n 0 -m esmini tests/export tests/cli $(ARGS)

test-commonroad: install ## drive by CommonRoad's reactive planner in an environment of its own: COMMONROAD=/path/to/venv
	HARNESS_REQUIRE_COMMONROAD=1 COMMONROAD="$(COMMONROAD)" $(BIN)/pytest -n 0 -m commonroad tests/drivers $(ARGS)

test-ros2: install ## drive by a ROS 2 node; ROS2 is an environment with rclpy: make test-ros2 ROS2=/path/to/venv
	HARNESS_REQUIRE_ROS2=1 ROS2="$(ROS2)" $(BIN)/pytest -n 0 -m ros2 tests/drivers $(ARGS)

wheel: install ## test the wheel in an environment of its own, with the locked versions: make wheel PYTHON=python3.13
	rm -rf build/wheel && $(PYTHON) -m venv build/wheel/venv
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation -w build/wheel .
	build/wheel/venv/bin/python -m pip install --quiet --disable-pip-version-check -c requirements.lock "$$(ls build/wheel/*.whl)[training]" pytest
	HARNESS_WHEEL_ENVIRONMENT=build/wheel/venv $(BIN)/pytest -n 0 tests/test_wheel.py $(ARGS)

coverage: install ## run every test and print the share of each module's lines that they run
	$(PYTEST) --cov=harness --cov-report=term $(ARGS)

bench: install ## what the harness costs, as ratios measured side by side: benchmarks/results.json, 20 minutes
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -c requirements.lock -e '.[bench]'
	$(BIN)/python -m benchmarks $(ARGS)

publish: install ## make policies, published runs and tables of documents anew: hours; `ARGS=--cost` says how many
	$(BIN)/python docs/publish/publish.py $(ARGS)

docs: install ## build the documentation site into build/site; a warning ends it
	$(BIN)/python docs/site/build.py build/site $(ARGS)

check: install ## lint, formatting and types, in under half a minute
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

lock: install ## rewrite requirements.lock with the newest versions that pyproject.toml allows
	grep '^#' requirements.lock > requirements.lock.new
	$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --fork-strategy fewest --extra dev \
	    --no-annotate --no-header --upgrade $(ARGS) pyproject.toml >> requirements.lock.new
	mv requirements.lock.new requirements.lock

clean: ## remove .venv and what the tools leave behind; run folders in reports/ stay
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist *.egg-info
	find harness tests -name __pycache__ -type d -prune -exec rm -rf {} +

$(INSTALLED): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' || { \
	    echo "$(PYTHON) is not a Python of 3.10 to 3.13: name one, e.g. make install PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -m venv .venv || { \
	    echo "$(PYTHON) can't make virtual environments (on Debian and Ubuntu: apt-get install python3-venv)" >&2; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv pip install --no-config --python $(BIN)/python -r requirements.lock
	$(BIN)/uv pip install --python $(BIN)/python --no-deps --no-build-isolation -e .
	@$(BIN)/python -c 'import libsumo' || { \
	    echo "SUMO lacks system libraries (on Debian and Ubuntu:" \
	        "apt-get install libatomic1 libgl1 libx11-6 libxext6 libxrender1)" >&2; exit 1; }
	@touch $@
