# Two commands matter: `make demo` and `make test`. Each makes its own .venv and installs what it needs.

# PyBullet has ready wheels for CPython 3.11 on Linux; on another Python it is compiled, which takes many minutes.
PYTHON := $(firstword $(shell for name in python3.11 python3; do \
	"$$(command -v $$name)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null && echo $$name; done))
ifeq ($(PYTHON),)
PYTHON := python3
endif
BIN := .venv/bin

.PHONY: demo test test-all bench check clean

demo: .venv/installed
	$(BIN)/quasiomni demo

test: .venv/installed
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow and not bench"

test-all: .venv/installed
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not bench"

bench: .venv/installed
	$(BIN)/python -m pytest -m bench -s

check: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

clean:
	rm -rf .venv runs

.venv/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit("Python 3.11 or newer is needed, this is %d.%d." % v[:2] if v < (3, 11) else 0)'
	@$(PYTHON) -c 'import sys; v = sys.version_info; v[:2] == (3, 11) or print("No Python 3.11 found: PyBullet has no wheel for %d.%d and will be compiled (10 to 30 minutes, needs a C++ compiler)." % v[:2])'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[emulator,records,dbc,ziglang,cosim,cluster,test]'
	@touch $@
