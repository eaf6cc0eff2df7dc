# Two commands matter: `make demo` and `make test`. Each makes the same .venv and installs what it needs: the demo the
# emulator alone, everything else all extras. Versions are those of constraints.txt.

# PyBullet has ready wheels for CPython 3.11 on Linux; with another Python the vehicle is emulated in MuJoCo alone.
PYTHON := $(firstword $(shell for name in python3.11 python3; do \
	"$$(command -v $$name)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null && echo $$name; done))
ifeq ($(PYTHON),)
PYTHON := python3
endif
comma := ,
BIN := .venv/bin
PIP := -m pip --disable-pip-version-check
WITH_PYBULLET := $(shell $(PYTHON) -c 'import sys; print("yes" if sys.version_info[:2] == (3, 11) else "")')
EMULATOR := $(if $(WITH_PYBULLET),emulator,mujoco)
ALL := .[$(if $(WITH_PYBULLET),emulator$(comma)mujoco,mujoco),records,dbc,ziglang,cosim,exam,cluster,video,mcap,web,test]

.PHONY: demo test test-all bench check constraints clean

demo: .venv/demo
	$(BIN)/quasiomni demo

# Tests start hundreds of processes: each would compile all modules again where the environment forbids keeping them.
test test-all: export PYTHONDONTWRITEBYTECODE =

test: .venv/installed
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder --timeout 300 -m "not slow and not bench"

test-all: .venv/installed
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder -m "not bench"

bench: .venv/installed
	$(BIN)/python -m pytest -m bench -s

check: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The newest versions that the lower bounds of pyproject.toml allow; `make test` then says whether they work.
constraints:
	rm -rf .venv-constraints
	$(PYTHON) -m venv .venv-constraints
	.venv-constraints/bin/python $(PIP) install --quiet '$(ALL)'
	sed -n '/^#/p' constraints.txt > .venv-constraints/constraints.txt
	.venv-constraints/bin/python $(PIP) freeze --exclude quasiomni >> .venv-constraints/constraints.txt
	mv .venv-constraints/constraints.txt constraints.txt
	rm -rf .venv-constraints

clean:
	rm -rf .venv runs

.venv/made:
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit("Python 3.11 or newer is needed, this is %d.%d." % v[:2] if v < (3, 11) else 0)'
	@$(PYTHON) -c 'import sys; v = sys.version_info; v[:2] == (3, 11) or print("No Python 3.11 found: the vehicle is emulated in MuJoCo, for which Python %d.%d has a wheel." % v[:2])'
	$(PYTHON) -m venv .venv
	@touch $@

.venv/demo: .venv/made pyproject.toml constraints.txt
	$(BIN)/python $(PIP) install --quiet --constraint constraints.txt --editable '.[$(EMULATOR)]'
	@touch $@

.venv/installed: .venv/made pyproject.toml constraints.txt
	$(BIN)/python $(PIP) install --quiet --constraint constraints.txt --editable '$(ALL)'
	@touch $@ .venv/demo
