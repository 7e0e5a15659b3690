# Everything lives in .venv, which this file makes. Where a ROS 2 is sourced, that one is used.
CONFIG ?= configs/greeter.yaml
PYTHON ?= python3
BIN := .venv/bin
ifdef ROS_DISTRO
EXTRAS := graph,test
VENV_FLAGS := --system-site-packages
else
EXTRAS := ros,interfaces,graph,ros-test,test
endif

.PHONY: up test check format docs bench clean

up: .venv/ready
	@$(BIN)/composer up $(CONFIG)

test: .venv/ready
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal $(ARGS)

check: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: .venv/ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: .venv/ready
	$(BIN)/python docs/generate.py

bench: .venv/ready
	$(BIN)/python -m benchmarks.run --json build/bench.json $(ARGS)

clean:
	rm -rf .venv build dist .mypy_cache .pytest_cache .ruff_cache

.venv/ready: pyproject.toml Makefile
	@echo 'setting up .venv, which takes about a minute'
	@$(PYTHON) -m venv $(VENV_FLAGS) .venv
	@$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	@touch $@
