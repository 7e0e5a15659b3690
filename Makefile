# Everything lives in .venv, which this file makes. Where a ROS 2 is sourced, that one is used.
# With ROS=kilted, it is .venv-kilted, which has the wheels of Kilted instead of Jazzy's.
# Both have the versions of constraints/; with NEWEST=1, a .venv-newest has the newest ones.
CONFIG ?= configs/greeter.yaml
PYTHON ?= python3
# Hundreds of processes are started, also where Python must not write what it compiles: none of
# them has to compile Composer. What is wrong, as examples of rules are on purpose, keeps nobody here.
COMPILE := -m compileall -qq composer behaviours
# Most tests wait, for processes and discovery: two cores serve more processes of tests than two.
WORKERS ?= 6
VENV := .venv
ifdef ROS_DISTRO
EXTRAS := record,types,foxglove,graph,page,hosts,dev
VENV_FLAGS := --system-site-packages
else ifeq ($(ROS),kilted)
VENV := .venv-kilted
EXTRAS := ros-kilted,interfaces,foxglove,graph,page,hosts,ros-kilted-test,dev
else
EXTRAS := ros,interfaces,foxglove,graph,page,hosts,ros-test,dev
endif
# The packages of a ROS 2 that is sourced are not ours to choose.
LOCKED := constraints/$(or $(ROS),jazzy).txt
ifndef ROS_DISTRO
CONSTRAINTS := $(LOCKED)
PIP_FLAGS := --constraint $(CONSTRAINTS)
endif
ifdef NEWEST
VENV := $(VENV)-newest
CONSTRAINTS := newest
PIP_FLAGS := --upgrade --upgrade-strategy eager
endif
BIN := $(VENV)/bin

.PHONY: up test test-all check format docs screenshots bench lock clean newest

up: $(VENV)/ready
	@$(BIN)/composer up $(CONFIG)

test: $(VENV)/ready
	env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist worksteal $(ARGS)

# Also those that take longer than a minute; and C++ programs, where the environment has them.
test-all: export LONG := 1
test-all: test

check: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/ready
	$(BIN)/python docs/generate.py

# The pictures of the page, by Chromium and its driver.
screenshots: $(VENV)/ready
	$(BIN)/python docs/screenshots.py

bench: $(VENV)/ready
	$(BIN)/python -m benchmarks.run --json build/bench.json $(ARGS)

# The versions of the lowest Python are there for newer ones, too. All have wheels but empy.
lock:
	@test -z "$(ROS_DISTRO)" || { echo 'run make lock without a sourced ROS 2: it lists the wheels of one'; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11) and "make lock needs Python 3.11: set PYTHON=python3.11")'
	@$(PYTHON) -m venv --clear build/lock
	@build/lock/bin/pip install --quiet --disable-pip-version-check --dry-run --ignore-installed \
	  --only-binary :all: --no-binary empy --report build/lock.json --editable '.[$(EXTRAS)]'
	@$(PYTHON) -c 'import json; packages = json.load(open("build/lock.json"))["install"]; \
	  print(*sorted("{name}=={version}".format(**package["metadata"]) for package in packages if not package["is_direct"]), sep="\n")' >$(LOCKED)

clean:
	rm -rf .venv .venv-* build dist .mypy_cache .pytest_cache .ruff_cache

$(VENV)/ready: pyproject.toml Makefile $(CONSTRAINTS)
	@case '$(ROS_DISTRO)' in foxy|galactic|humble|iron) \
	  echo 'error: ROS 2 $(ROS_DISTRO) is sourced, which is too old: use Jazzy or later' >&2; exit 1;; esac
	@test -n '$(ROS_DISTRO)' || test "$$(uname -m)" = x86_64 || { \
	  echo "error: there are no wheels of ROS 2 for $$(uname -m)" >&2; \
	  echo 'help: source a ROS 2 first (. /opt/ros/jazzy/setup.sh), or use conda or a container: docs/workspaces.md' >&2; \
	  exit 1; }
	@echo 'setting up $(VENV), which takes about a minute'
	@# One whose set-up was interrupted may have halves of packages.
	@test -e $@ || rm -rf $(VENV)
	@rm -f $@
	@$(PYTHON) -m venv $(VENV_FLAGS) $(VENV)
	@$(BIN)/pip install --quiet --disable-pip-version-check $(PIP_FLAGS) --editable '.[$(EXTRAS)]'
	@$(BIN)/python $(COMPILE) || true
	@touch $@
