# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0

HOOC := .venv/bin/hooc
PYTEST_ARGS ?=
# Of `make results`: which sets (SHAPES, HOTS, GLASSWARE, OSD, MOVES and DEV are folders), which rows
# (none named: all, of SHAPES, HOTS and GLASSWARE best and fast, of MOVES best and incremental), what to
# keep or to force.
RESULTS ?= results
SETS ?= twin
SHAPES ?=
HOTS ?=
GLASSWARE ?=
OSD ?=
MOVES ?=
DEV ?=
ROWS ?=
KEEP ?=
FORCE ?=
JOBS ?= 0

.PHONY: help setup demo test results bundle network lint docs lock clean

help:
	@echo 'make demo    set up if need be, then find the objects of the bundled scene'
	@echo 'make test    set up if need be, then run every test (PYTEST_ARGS="-k name" for some)'
	@echo 'make setup   only set up'
	@echo 'make results recompute the tables of docs/results.md: SHAPES=folder HOTS=folder GLASSWARE=folder'
	@echo '             OSD=folder MOVES=folder DEV=folder for more sets, SETS= to leave out the twin,'
	@echo '             ROWS="best fast ablations", KEEP="paper fpfh ppf", FORCE="best", RESULTS=folder,'
	@echo '             JOBS=1'
	@echo 'make bundle  make the bundled scene and model again'
	@echo 'make network train the network over the table again (needs the extra network, takes hours)'
	@echo 'make lint    check style, spelling and types'
	@echo 'make docs    build the documentation site in out/site'
	@echo 'make lock    resolve pyproject.toml into requirements.txt again (PYTHONS="python3.11 python3.12")'

setup:
	@bash scripts/setup.sh

demo: setup
	@$(HOOC) demo

test: setup
	@.venv/bin/python -m pytest -n auto --maxprocesses 4 --dist loadfile \
	  --no-loadscope-reorder $(PYTEST_ARGS)

results: setup
	@.venv/bin/python -m hooc_perception.experiments --out $(RESULTS) \
	  $(addprefix --set ,$(if $(SHAPES),shapes=$(SHAPES)) $(if $(HOTS),hots=$(HOTS)) \
	    $(if $(GLASSWARE),glassware=$(GLASSWARE)) $(if $(OSD),osd=$(OSD)) \
	    $(if $(MOVES),moves=$(MOVES)) $(if $(DEV),dev=$(DEV)) $(SETS)) \
	  $(if $(ROWS),--rows $(ROWS)) $(if $(KEEP),--keep $(KEEP)) $(if $(FORCE),--force $(FORCE)) --jobs $(JOBS)

bundle: setup
	@$(HOOC) demo --make-bundle

network: setup
	@.venv/bin/python -m hooc_perception.training.network

lint: setup
	@.venv/bin/ruff check .
	@.venv/bin/codespell
	@.venv/bin/pyright

docs: setup
	@NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict

lock:
	@.venv/bin/python scripts/lock.py $(PYTHONS)

clean:
	rm -rf build install log out .pytest_cache .ruff_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
