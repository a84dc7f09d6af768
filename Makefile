# make demo     optimise the bartender sample, and print the errors before and after
# make test     lint, format, types, documentation and tests
# make test-lowest    the tests with the lowest supported versions of the dependencies (needs Python 3.11)
# make release-check  these, and with the newest versions as well; the result goes into docs/evidence/systems.md
# make test-portable  the tests as on other processors, with meshes made anew and other numbers of threads
# make docs     the documentation, in build/docs
# make fuzz     random robots (RUNS=50 SEED=1), then ten minutes of damage to each kind of file (FUZZED= for none)
# make torture  hours of kills, full disks, damaged caches and other faults (RUNS=20 SEED=1 for a short one)
# make golden   errors and frequencies of the samples and of robots of others, against the numbers that are kept
# make audit    known weaknesses of the dependencies; fails where there is no data on them (needs the network)
# make wheels   wheels with compiled kernels for each Python here, each tested in an empty folder, in dist
# make samples  build the sample characters again (make pictures optimises and draws them)
# make blender  the extension of Blender as a zip (make blender-test tests it; needs Python 3.11)
# make clean    remove what was built, and the environment
#
# Needs make and Python 3.11 to 3.14 with pip; PYTHON=... chooses one.

SHELL := /bin/sh
VENV ?= .venv
RUN := $(VENV)/bin/python
# A virtual environment does not survive being moved, so the stamps name the folder they are for.
HERE := $(shell printf '%s' "$(CURDIR)" | cksum | cut -d' ' -f1)
MADE := $(VENV)/.made-$(HERE)
INSTALLED := $(VENV)/.installed-$(HERE)
INSTALLED_DEV := $(VENV)/.installed-dev-$(HERE)

CHECK := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))
PYTHON ?= $(shell for python in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	command -v $$python >/dev/null 2>&1 && $$python -c '$(CHECK)' >/dev/null 2>&1 && echo $$python && break; done)

export PIP_DISABLE_PIP_VERSION_CHECK := 1
# What test-lowest and test-portable run: TESTS="tests/linear_algebra -k ordering" for less than all.
TESTS ?= tests

.PHONY: help demo wheel wheels test test-lowest release-check test-portable docs fuzz torture audit golden samples pictures blender blender-test blender-pictures clean
.DELETE_ON_ERROR:

help:
	@sed -n 's/^# \{0,1\}//p' Makefile | sed -n '1,15p'

demo: $(INSTALLED)
	$(RUN) -m calmotion demo -o build

# Every check runs, also when an earlier one fails, so that one run shows all there is to repair.
test: $(INSTALLED_DEV)
	@status=0; summary=; \
	check() { \
		name=$$1; shift; echo "== $$name"; \
		if "$$@"; then summary="$$summary$$name: passed\n"; else summary="$$summary$$name: FAILED\n"; status=1; fi; \
	}; \
	check ruff $(RUN) -m ruff check .; \
	check format $(RUN) -m ruff format --check --quiet .; \
	check mypy $(RUN) -m mypy; \
	check "mypy for Windows" $(RUN) -m mypy --platform win32 --cache-dir .mypy_cache/win32; \
	check "mypy for macOS" $(RUN) -m mypy --platform darwin --cache-dir .mypy_cache/darwin; \
	check bandit $(RUN) -m bandit -q -ll -r pipeline plugins; \
	check pytest $(RUN) -m pytest -n 2 -q; \
	echo "== summary"; printf "$$summary"; exit $$status

# What optimize promises on the samples and on robots of others, against the numbers that are kept.
golden: $(INSTALLED_DEV)
	$(RUN) tests/golden/golden.py compare tests/golden/golden.json

PYTHONS ?= 3.11 3.12 3.13 3.14
# The processors of the last ten years; others compile the kernels as they do without this wheel.
WHEEL_CPU := NUMBA_CPU_NAME=x86-64-v3 NUMBA_CPU_FEATURES=+avx,+avx2,+bmi,+bmi2,+cx16,+f16c,+fma,+lzcnt,+movbe,+popcnt,+sse3,+sse4.1,+sse4.2,+ssse3,+xsave
wheel: $(INSTALLED)
	@rm -rf build/wheel && mkdir -p build/wheel dist
	env CALMOTION_CACHE=$(CURDIR)/build/wheel/cache $(WHEEL_CPU) $(RUN) .ci/wheel_kernels.py build/wheel/kernels
	env CALMOTION_WHEEL_KERNELS=$(CURDIR)/build/wheel/kernels $(RUN) -m pip wheel --quiet --no-deps -w build/wheel .
	$(RUN) .ci/wheel_test.py build/wheel/calmotion-*.whl samples/bartender
	@mv build/wheel/calmotion-*.whl dist

# Each version of Python gets an environment of its own, beside those of other versions.
wheels:
	@mkdir -p dist; built=; \
	for version in $(PYTHONS); do \
		command -v python$$version >/dev/null 2>&1 || { echo "python$$version is not here: no wheel for it"; continue; }; \
		$(MAKE) --no-print-directory wheel VENV=.venv-wheel-$$version PYTHON=python$$version || exit 1; \
		built=$$version; \
	done; \
	test -n "$$built" || { echo "error: none of Python $(PYTHONS) was found on the PATH" >&2; exit 1; }; \
	.venv-wheel-$$built/bin/python -m pip wheel --quiet --no-deps -w dist . && ls dist/calmotion-*.whl

docs: $(INSTALLED_DEV)
	NO_MKDOCS_2_WARNING=1 $(RUN) -m mkdocs build --strict --quiet
	@echo "build/docs/index.html"

# An environment of its own, in which each dependency has its lower bound of pyproject.toml.
LOWEST_VENV ?= .venv-lowest
$(LOWEST_VENV)/.installed: pyproject.toml .ci/lowest_versions.py
	python3.11 -m venv --clear $(LOWEST_VENV)
	$(LOWEST_VENV)/bin/python .ci/lowest_versions.py > $(LOWEST_VENV)/lowest.txt
	$(LOWEST_VENV)/bin/python -m pip install --quiet --constraint $(LOWEST_VENV)/lowest.txt --editable '.[dev]'
	@touch $@

test-lowest: $(LOWEST_VENV)/.installed
	$(LOWEST_VENV)/bin/python -m pytest -n 2 -q $(TESTS)

# Python 3.11 with the lowest versions, and the newest Python that is here with the newest.
release-check:
	$(PYTHON) .ci/release_check.py

# Each line: kernels of OpenBLAS, threads, and what NumPy and numba may use. Each run has a cache folder of its own, so
# that meshes and kernels are made anew. Results that a test compares must not depend on any of this.
test-portable: $(INSTALLED_DEV)
	@status=0; summary=; \
	run() { \
		name=$$1; shift; echo "== $$name"; cache=$$(mktemp -d); \
		if env XDG_CACHE_HOME="$$cache" "$$@" $(RUN) -m pytest -n 2 -q $(TESTS); then result=passed; \
		else result=FAILED; status=1; fi; \
		summary="$$summary$$name: $$result\n"; rm -rf "$$cache"; \
	}; \
	run "Haswell, 1 thread" OPENBLAS_CORETYPE=Haswell OPENBLAS_NUM_THREADS=1; \
	run "Sandybridge, 2 threads" OPENBLAS_CORETYPE=Sandybridge OPENBLAS_NUM_THREADS=2; \
	run "Prescott, 3 threads, no AVX" OPENBLAS_CORETYPE=Prescott OPENBLAS_NUM_THREADS=3 NUMBA_CPU_NAME=x86-64-v2 \
		NPY_DISABLE_CPU_FEATURES=X86_V3; \
	echo "== summary"; printf "$$summary"; exit $$status

# Random robots first. Their shots, where something is wrong, stay in build/fuzz/robots.
FUZZED ?= shot splines meshes bvh recordings motions manifests settings
fuzz: RUNS = 200
fuzz: $(INSTALLED_DEV)
	$(RUN) -m pytest -q -x tests/fuzz
	$(RUN) tests/fuzz/robots/robot_campaign.py --runs $(RUNS) --seed $(SEED)
	@test -z "$(FUZZED)" || $(RUN) -m pip install --quiet --editable '.[fuzz]'
	@status=0; for target in $(FUZZED); do \
		echo "== $$target"; $(RUN) tests/fuzz/guided.py $$target $${CALMOTION_FUZZ:-600} || status=1; \
	done; exit $$status

# All hostile commands, then a thousand kills, and other faults in proportion.
SEED ?= 0
RUNS ?= 1000
torture: $(INSTALLED_DEV)
	$(RUN) -m pytest -q -n 1 -m "long or not long" tests/hostile
	$(RUN) tests/torture/campaign.py --runs $(RUNS) --seed $(SEED)

audit: $(INSTALLED_DEV)
	@$(RUN) -m pip install --quiet --editable '.[audit]'
	$(RUN) .ci/audit.py

blender: $(MADE)
	@mkdir -p dist
	cd plugins/blender && $(CURDIR)/$(RUN) -m zipfile -c $(CURDIR)/dist/calmotion_blender.zip *.py *.toml README.md LICENSE

# Blender's Python module is large, wants an older NumPy and is GPL: it gets an environment of its own.
# Another version of Blender: make blender-test BPY=4.2.0 BLENDER_VENV=.venv-blender42
BLENDER_VENV ?= .venv-blender
BPY ?= 5.0.1
$(BLENDER_VENV)/.installed:
	python3.11 -m venv --clear $(BLENDER_VENV)
	$(BLENDER_VENV)/bin/python -m pip install --quiet bpy==$(BPY)
	@touch $@

blender-test: $(INSTALLED_DEV) $(BLENDER_VENV)/.installed
	CALMOTION_BLENDER_PYTHON=$(CURDIR)/$(BLENDER_VENV)/bin/python $(RUN) -m pytest -q tests/blender

blender-pictures: $(INSTALLED) $(BLENDER_VENV)/.installed
	CALMOTION_COMMAND="$(CURDIR)/$(RUN) -m calmotion" $(BLENDER_VENV)/bin/python samples/blender/render.py \
		plugins/blender build/blender
	$(RUN) samples/pictures.py --frames build/blender docs/tutorials/blender.webp

samples: $(INSTALLED)
	@for script in samples/*/build.py; do echo "$$script"; $(RUN) "$$script" || exit 1; done

pictures: $(INSTALLED)
	$(RUN) samples/pictures.py

clean:
	rm -rf $(VENV) .venv-wheel-* $(LOWEST_VENV) .venv-newest $(BLENDER_VENV) build dist .mypy_cache .pytest_cache .ruff_cache
	find pipeline plugins samples tests -name __pycache__ -type d -prune -exec rm -rf {} +

# The interpreter that the environment was made with may be gone: then it is made again.
ifneq ($(shell $(RUN) -c 'print(1)' 2>/dev/null),1)
.PHONY: $(MADE)
endif

$(MADE):
	@test -n "$(PYTHON)" || { \
		echo "error: no Python 3.11 to 3.14 with venv and pip was found on the PATH." >&2; \
		echo "Install one (on Debian or Ubuntu also python3-venv), or name it: make PYTHON=/path/to/python3" >&2; \
		exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

$(INSTALLED): $(MADE) pyproject.toml hatch_build.py
	@echo "Installing Calmotion and what it needs into $(VENV); the first time this takes some minutes."
	@$(RUN) -m pip install --quiet --editable .
	@touch $@

$(INSTALLED_DEV): $(MADE) pyproject.toml hatch_build.py
	@echo "Installing Calmotion and what its tests need into $(VENV); the first time this takes some minutes."
	@$(RUN) -m pip install --quiet --editable '.[dev]'
	@touch $@ $(INSTALLED)
