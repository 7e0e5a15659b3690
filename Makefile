# Everything lives in .venv, which this file makes. Where a ROS 2 is sourced, that one is used.
# With ROS=kilted, it is .venv-kilted, which has the wheels of Kilted instead of Jazzy's.
CONFIG ?= configs/greeter.yaml
PYTHON ?= python3
# Most tests wait, for processes and discovery: two cores serve more processes of tests than two.
WORKERS ?= 4
VENV := .venv
ifdef ROS_DISTRO
EXTRAS := graph,hosts,dev
VENV_FLAGS := --system-site-packages
else ifeq ($(ROS),kilted)
VENV := .venv-kilted
EXTRAS := ros-kilted,interfaces,graph,hosts,ros-kilted-test,dev
else
EXTRAS := ros,interfaces,graph,hosts,ros-test,dev
endif
BIN := $(VENV)/bin

.PHONY: up test check format docs bench clean

up: $(VENV)/ready
	@$(BIN)/composer up $(CONFIG)

test: $(VENV)/ready
	$(BIN)/python -m pytest --numprocesses $(WORKERS) --dist worksteal $(ARGS)

check: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/ready
	$(BIN)/python docs/generate.py

bench: $(VENV)/ready
	$(BIN)/python -m benchmarks.run --json build/bench.json $(ARGS)

clean:
	rm -rf .venv .venv-kilted build dist .mypy_cache .pytest_cache .ruff_cache

$(VENV)/ready: pyproject.toml Makefile
	@echo 'setting up $(VENV), which takes about a minute'
	@# One whose set-up was interrupted may have halves of packages.
	@test -e $@ || rm -rf $(VENV)
	@rm -f $@
	@$(PYTHON) -m venv $(VENV_FLAGS) $(VENV)
	@$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	@touch $@
