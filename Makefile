# make demo | test | quick | docs | bench | gpu | soak | format | lint | sanitize | release_checks | stubs | clean. All that is made lies in .venv, build and out.
SHELL := /bin/bash -o pipefail
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# The first Python that is new enough; with none, the check of the environment says so.
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && exit; done; echo python3)
JOBS ?= $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
# CMake variables for the build of the Python package: NAME=VALUE ...
CONFIG ?=
PYTHONS ?=

export PATH := $(CURDIR)/$(if $(filter Windows_NT,$(OS)),.venv/Scripts,.venv/bin):$(PATH)
export CMAKE_BUILD_PARALLEL_LEVEL := $(JOBS)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Each program that tests start would compile the package again.
unexport PYTHONDONTWRITEBYTECODE
# Python for Windows puts its programs elsewhere.
BIN := .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
BUILD := build/python
FORMATTED = $(shell find include src bindings fmu playground tests/cpp benchmarks examples \( -name '*.hpp' -o -name '*.cpp' \))
# Folders are prerequisites too: their time changes when a file is added or removed.
NATIVE := $(shell find include src bindings fmu cmake 2>/dev/null) CMakeLists.txt pyproject.toml
# What lint runs of tools; check_policy.py follows when the rooms that it lists have their policy.hpp.
CHECKS := check_layers check_style check_policy check_words
say = @printf '\033[1m%s\033[0m\n'

# The length (s) of make soak and of the soak under asan in make release_checks, and the seed of all their cases.
SOAK_SECONDS ?= 3600
SANITIZED_SOAK_SECONDS ?= 600
SOAK_SEED ?= 1

.PHONY: help demo test room quick quick_room cpp_tests browser pocl gpu docs figures replays playground notebooks bench soak format lint sanitize release_checks stubs wheel wheels wheels-test cross clean install
help:
	@echo 'make demo      a wrecking ball hits a wall of 750 bricks: recording, pictures, figures in out/demo'
	@echo 'make test      C++ and Python tests;  make test ROOM=io  those of one room, ROOM=core  of the engine;  make quick ROOM=joint  by file name'
	@echo 'make docs      the documentation site, in build/site'
	@echo 'make replays   all robots and scenes as pages with a play bar, in out/replays, which make docs takes into the site'
	@echo 'make playground the engine in a page of the browser, in out/playground, which make docs takes into the site'
	@echo 'make notebooks the tutorials as notebooks, in out/notebooks;  make figures  pictures of the documents'
	@echo 'make bench     benchmarks, the most important first, into benchmarks/results and the documents;  make bench ONLY="growth orders"'
	@echo 'make gpu       tests and benchmarks of devices, on the GPUs that there are; written to benchmarks/results'
	@echo 'make soak      random damage, misuse and scenes for an hour; the table goes to benchmarks/results'
	@echo 'make format    format the C++ and Python sources;  make lint  only check'
	@echo 'make sanitize  C++ tests under the address, undefined-behaviour and thread sanitizers'
	@echo 'make release_checks  what .ci/run leaves out: the Python module under sanitizers, make soak, make wheel'
	@echo 'make wheel     wheels for this Linux and the source distribution, tried in empty environments, in dist'
	@echo 'make wheels    wheels for Linux, macOS and Windows, by cross compilation;  make wheels-test  run them by qemu and wine'
	@echo 'make stubs     renew the committed stub of the compiled module;  make clean  remove what was built'

# Exit code 1 says that some steps, or all methods, ended at their limits: the tables tell which.
demo: install
	@mkdir -p out/demo
	$(say) 'A wrecking ball hits a wall of 750 bricks: two seconds of it, in a minute or two'
	@$(BIN)/amontons run wall --duration 2 --tolerance 1e-3 --threads $(JOBS) \
	  --record out/demo/wall.h5 --overwrite --record-every 4 --report out/demo --snapshots 6 --azimuth 50 || [ $$? -eq 1 ]
	$(say) 'The step in which the ball strikes, solved by every method'
	@$(BIN)/amontons export wall --touch ball --tolerance 1e-3 -o out/demo/impact.npz || [ $$? -eq 1 ]
	@$(BIN)/amontons compare out/demo/impact.npz --tolerance 1e-3 --deadline 4 --output out/demo || [ $$? -eq 1 ]
	$(say) 'Open'
	@for f in snapshots.png report.png convergence.png wall.h5; do echo "$(CURDIR)/out/demo/$$f"; done
	$(say) 'Watch it in the browser'
	@echo '$(BIN)/amontons view out/demo/wall.h5 --play      what was recorded'
	@echo '$(BIN)/amontons view wall --tolerance 1e-3 --play  the simulation itself: pick a brick, pull it'
	$(say) 'Go on with'
	@echo 'docs/five-minutes.md, or all documents as a site: make docs'

# All tests but those of the repository itself; ROOM=io those of one room, a folder of tests or of tests/python;
# ROOM=core those of the engine, in which no extra can be imported. Workers fill the processors: further threads of
# NumPy would wait for each other, and a report of a wall takes three times the processor time.
ROOM ?=
CORE := model problem simulation physics
test: room $(if $(filter-out cpp core,$(or $(ROOM),all)),install browser pocl,install) $(if $(filter-out cpp core,$(ROOM)),,cpp_tests)
ifneq ($(ROOM),cpp)
	$(say) 'Python tests'
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(JOBS) --dist worksteal $(if $(filter core,$(ROOM)),--core) \
	  $(wildcard $(foreach room,$(ROOM:core=$(CORE)),tests/$(room) tests/python/$(room)))
endif

ROOMS := core $(filter-out README.md conftest.py python support,$(notdir $(wildcard tests/*)) $(notdir $(wildcard tests/python/*)))
room:
	@for room in $(ROOM); do case ' $(ROOMS) ' in *" $$room "*) ;; *) \
	  echo "amontons: no room of tests is named $$room; take one of: $(sort $(ROOMS))" >&2; exit 2;; esac; done

# The test files with the word ROOM in their names; several words are possible. Each C++ file is a program of its own.
QUICK_CPP = $(sort $(foreach room,$(ROOM),$(wildcard tests/cpp/test_*$(room)*.cpp)))
QUICK_PYTHON = $(sort $(foreach room,$(ROOM),$(wildcard $(foreach folder,python/* physics repository,tests/$(folder)/test_*$(room)*.py))))
quick: quick_room install
	@for name in $(basename $(notdir $(QUICK_CPP))); do \
	  cmake --build $(BUILD) --target $$name && echo "$$name" && $(BUILD)/tests/cpp/$$name || exit 1; done
	@test -z '$(QUICK_PYTHON)' || $(BIN)/python -m pytest -q $(QUICK_PYTHON)

quick_room:
	@test -n '$(QUICK_CPP)$(QUICK_PYTHON)' || { echo 'amontons: no file tests/*/test_*ROOM* for ROOM=$(ROOM);' \
	  'try make quick ROOM=joint, shapes, islands, urdf' >&2; exit 2; }

# Chromium for the tests of the viewer, where there is none and one can be had; else these tests are skipped.
browser: .venv/.requirements
	@mkdir -p build && command -v chromium chromium-browser google-chrome >/dev/null \
	  || timeout 300 $(BIN)/python -m playwright install chromium-headless-shell >build/browser.log 2>&1 \
	  || { test "$$(id -u)" = 0 && command -v apt-get >/dev/null \
	    && { apt-get update && apt-get install -y --no-install-recommends chromium; } >>build/browser.log 2>&1; } \
	  || echo 'no browser could be installed (build/browser.log): apt-get install chromium as root; the tests of pages are skipped'

# OpenCL on the processor for the tests of devices, where the platform has it; else these tests are skipped. The driver
# of the package index does not know the newest processors: root gets that of the system.
COMPILES := from amontons.device import found; found.open_device(found.chosen_device("opencl"))
pocl: install
	@$(BIN)/python -c '$(COMPILES)' 2>/dev/null \
	  || { timeout 300 $(BIN)/python -m pip install --quiet --progress-bar off $$($(BIN)/python tools/requirements.py pocl) \
	    && $(BIN)/python -c '$(COMPILES)'; } >build/pocl.log 2>&1 \
	  || { test "$$(id -u)" = 0 && command -v apt-get >/dev/null && { apt-get update \
	    && apt-get install -y --no-install-recommends pocl-opencl-icd && $(BIN)/python -c '$(COMPILES)'; } >>build/pocl.log 2>&1; } \
	  || echo 'no OpenCL that compiles could be installed (build/pocl.log); the tests of devices on pocl are skipped'

# On a machine with a GPU, its driver, and CuPy or pyopencl in .venv: ten minutes.
gpu: install
	@$(BIN)/python -c 'import cupy' 2>/dev/null || $(BIN)/python -c 'import pyopencl' 2>/dev/null \
	  || { echo 'amontons: needs CuPy or pyopencl: .venv/bin/pip install -e ".[cuda]" or ".[opencl]"' >&2; exit 1; }
	@AMONTONS_DEVICE=gpu $(BIN)/python -m pytest -q tests/python/device
	@$(BIN)/python benchmarks/device.py

cpp_tests: install
	$(say) 'C++ tests'
	@cmake --build $(BUILD) --target amontons_tests
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

# Replays are made once: remove out/replays to renew them. Whatever MkDocs warns about is an error: dead links and headings, pages that no menu leads to, equations that are none.
docs: .venv/.docs replays
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet && echo 'build/site/index.html'

# Pictures of the concepts and of all scenes, which the pages show.
figures: install
	@MPLBACKEND=Agg $(BIN)/python tools/concept_figures.py
	@MPLBACKEND=Agg $(BIN)/python tools/law_figures.py
	@$(BIN)/python tools/diagrams.py
	@$(BIN)/python tools/gallery.py
	@$(BIN)/python -c 'import mujoco' 2>/dev/null && $(BIN)/python tools/creep.py || echo 'without MuJoCo docs/figures/creep.webp stays as it is'

replays: install
	@$(BIN)/python tools/gallery.py --replays

# The wrecking ball in motion, for the README.
docs/figures/wall.webp: out/demo/wall.h5 | install
	@$(BIN)/amontons export $< --gif $@ --size 640x300 --fps 12.5 --speed 0.5 --azimuth 50

out/demo/wall.h5: | install
	@mkdir -p out/demo
	@$(BIN)/amontons run wall --duration 2 --tolerance 1e-3 --threads $(JOBS) --record $@ --record-every 4 || [ $$? -eq 1 ]

# The core as WebAssembly in a page (docs/playground.md); needs emscripten and, once, the npm registry.
playground: install
	$(say) 'Compiling the core to WebAssembly: minutes, when it changed'
	@$(BIN)/python tools/make_playground.py

notebooks: install
	@$(BIN)/python tools/website/notebooks.py

bench: install
	@cmake --build $(BUILD) --target amontons_benchmarks
	@$(BIN)/python benchmarks/run_all.py $(if $(ONLY),--only $(ONLY))

soak: install
	@PYTHONPATH=tools $(BIN)/python -m soak --seed $(SOAK_SEED) --seconds $(SOAK_SECONDS) --jobs $(JOBS) \
	  --csv benchmarks/results/processor/soak.csv --into tests/python/soak

format: .venv/.requirements
	@$(BIN)/clang-format -i $(FORMATTED)
	@$(BIN)/ruff check --fix --exit-zero --quiet && $(BIN)/ruff format && $(BIN)/ruff check

lint: .venv/.requirements
	@code=0; \
	$(BIN)/clang-format --dry-run -Werror $(FORMATTED) || code=1; \
	$(BIN)/ruff check || code=1; \
	$(BIN)/ruff format --check || code=1; \
	for check in $(CHECKS); do $(BIN)/python tools/$$check.py || code=1; done; \
	exit $$code

sanitize: .venv/.requirements
	@for preset in asan tsan; do tools/sanitize $$preset || exit 1; done

# Before a release, beside .ci/run: what takes an hour or more. The preset dev compiles source by source.
release_checks: install
	@$(BIN)/python tools/check_tables.py
	@$(BIN)/python -m pytest -q -m slow_machine
	@cmake --preset dev >/dev/null && cmake --build build/dev --target amontons amontons_tests -j $(JOBS)
	@SOAK_SECONDS=$(SANITIZED_SOAK_SECONDS) SOAK_SEED=$(SOAK_SEED) JOBS=$(JOBS) tools/sanitize asan --python
	@$(MAKE) --no-print-directory soak wheel

stubs: install
	@cmake --build $(BUILD) --target amontons_stub
	@cp $(BUILD)/_core.pyi python/amontons/_core.pyi && echo 'python/amontons/_core.pyi'

# Wheels for this system, for the interpreters in PYTHONS, by default every python3.X on the path; and each of these tries them.
wheel: install
	@$(MAKE) --no-print-directory wheels TARGETS=here
	@$(BIN)/python tools/make_wheel.py --try $(PYTHONS)

# Wheels for the systems of tools/wheel_targets.py, or those in TARGETS; minutes of compilation for each.
TARGETS ?= all
wheels: install
	$(say) 'Wheels for Linux, macOS and Windows in dist'
	@$(BIN)/python tools/make_wheel.py --targets $(TARGETS) --jobs $(JOBS) $(PYTHONS)

# What `make wheels` made, with the C++ tests: aarch64 by qemu, Windows by wine. RUNS=windows-x86_64 for one of them.
RUNS ?= linux-x86_64,linux-aarch64,windows-x86_64
wheels-test: install
	$(say) 'Tests of what was built for other systems'
	@$(BIN)/python tools/wheels_test.py --targets $(RUNS) --jobs $(JOBS) $(PYTHONS)

# A few sources for other systems, compiled and linked.
cross: install .venv/.zig
	@$(BIN)/python tools/cross_check.py .venv/zig/bin/python

.venv/.zig: | .venv/.requirements
	@$(PYTHON) -m venv .venv/zig && .venv/zig/bin/python -m pip install --quiet --progress-bar off 'ziglang>=0.13'
	@touch $@

clean:
	rm -rf .venv build out dist .pytest_cache .ruff_cache .hypothesis

install: .venv/.requirements .venv/.amontons

.venv/.checked: tools/check_environment.py
	@command -v $(PYTHON) >/dev/null || { echo 'amontons: no python3 found: install Python 3.11 or newer' >&2; exit 1; }
	@$(PYTHON) tools/check_environment.py
	@mkdir -p .venv && touch $@

# The compiler needs only these: `make -j2 install` installs the others beside it. FMPy, one of these, brings CMake: as
# objects of another CMake would be out of date, it is here from the start.
.venv/.build: pyproject.toml tools/requirements.py | .venv/.checked
	$(say) 'Installing the build tools into .venv'
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --quiet --progress-bar off $$($(BIN)/python tools/requirements.py build) cmake \
	  $$($(BIN)/python tools/check_environment.py --build-tools)
	@touch $@

.venv/.requirements: .venv/.build
	$(say) 'Installing the requirements into .venv'
	@$(BIN)/python tools/requirements.py > .venv/requirements.txt
	@$(BIN)/python -m pip install --progress-bar off -r .venv/requirements.txt \
	  | sed -u -n 's/^Collecting \([^ (]*\).*/  \1/p'
	@touch $@

.venv/.docs: pyproject.toml | .venv/.requirements
	$(say) 'Installing what makes the documentation'
	@$(BIN)/python -m pip install --quiet --progress-bar off $$($(BIN)/python tools/requirements.py docs)
	@touch $@

# Editable: Python sources are used in place. The build folder stays, so that only what changed is compiled.
.venv/.amontons: $(NATIVE) | .venv/.build
	$(say) 'Compiling amontons'
	@mkdir -p build
	@CXX="$$($(BIN)/python tools/check_environment.py --compiler)" \
	  $(BIN)/python -m pip install -v --no-build-isolation --no-deps -e . \
	  $(addprefix --config-settings ,build-dir=$(BUILD) $(addprefix cmake.define.,AMONTONS_TESTS=ON $(CONFIG))) \
	  2>&1 | tee build/install.log \
	  | { grep --line-buffered -oE '\[[0-9]+/[0-9]+\] .*' || true; } \
	  || { sed -n '/FAILED:/,/build stopped/p' build/install.log | grep . || tail -n 30 build/install.log; \
	       echo 'amontons: the build failed; all of its output is in build/install.log' >&2; exit 1; }
	@touch $@
