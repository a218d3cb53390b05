# Everything that a user or a check runs; `make` alone lists it.
#   JOBS=8 make reproduce                jobs at a time (2)
#   make setup PYTHON=python3.12         the Python that .venv is made from (python3); `make clean` first to change it
#   make benchmark PEERS=1               measure public solvers too, from their own environment .venv-peers
#   make cluster SCENE=smoke             one scene on Slurm, not the default ones
#   make faults COUNT=40                 40 faults in place of 20; SEED=2 for others
#   make fuzz COUNT=500                  the first 500 of 2000 scenes a test; SEED=today for others at each run
#   make stress SEED=today SHARE=0.1     a tenth of each campaign, with other random problems, the same all day

PYTHON ?= python3
JOBS ?= 2
VENV := .venv
PEERS_VENV := .venv-peers
DOCS_VENV := .venv-docs
MEASURE_VENV := $(if $(filter 1,$(PEERS)),$(PEERS_VENV),$(VENV))
RUN := $(VENV)/bin/python -m
PIP_INSTALL := pip install --quiet --disable-pip-version-check --no-input --no-compile --require-hashes

# The package is not built: it runs from this folder, and so does each job that Snakemake starts.
export PYTHONPATH := $(CURDIR)/src
# Of the installed code a third is imported: that is compiled to byte code, and kept, at its first import.
unexport PYTHONDONTWRITEBYTECODE
# One thread a process: jobs run side by side, and results do not depend on the number of cores.
export OPENBLAS_NUM_THREADS := 1

# What the study calls. Loads, of which the paper has none, are compiled by `make setup` or their first run.
compile = echo "Compiling, half a minute" && mkdir -p .cache && { \
	$(RUN) workflow.study.compile coarse fine strips 2> .cache/contact.log & \
	$(RUN) workflow.study.compile motion 2> .cache/motion.log && wait $$! || { cat .cache/contact.log .cache/motion.log; false; }; }

# Of the results of a scene, what git keeps
KEPT := figure_chain.png figure2.png figure3.png figure5.png claims.json costs.json summary.csv

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: FORCE help setup reproduce smoke test test-all nightly lint benchmark stress verify schema faults fuzz cluster reference docs package clean

# If the home folder cannot be written to, caches of libraries go into the project.
ifneq ($(shell test -w "$$HOME" && echo yes),yes)
export XDG_CACHE_HOME := $(CURDIR)/.cache
export XDG_CONFIG_HOME := $(CURDIR)/.cache
export MPLCONFIGDIR := $(CURDIR)/.cache/matplotlib
endif

help: ## list these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' Makefile

setup: $(VENV)/run.stamp ## make .venv from requirements.lock and compile (each target below does so if it is missing)
	@mkdir -p .cache && $(RUN) workflow.study.compile cells 2> .cache/loads.log || { cat .cache/loads.log; false; }

reproduce: $(VENV)/run.stamp ## reproduce the paper: figures, claims and results/report.html
	$(RUN) snakemake -j$(JOBS)

smoke: $(VENV)/run.stamp ## run every stage on a tiny scene
	$(RUN) snakemake -j$(JOBS) smoke

test: $(VENV)/dev.stamp ## run the fast tests, a minute and a half on two cores
	$(RUN) pytest -n $(JOBS) --dist loadfile -m "not slow and not nightly"

test-all: test ## run all tests of a change: the fast ones, then the slow ones
	$(RUN) pytest -n $(JOBS) --dist loadfile -m slow

nightly: $(VENV)/dev.stamp ## run the statistics of many repetitions, and keep the evidence with the hash of the sources
	$(RUN) tests.nightly -j $(JOBS)

lint: $(VENV)/dev.stamp ## check style, format and types
	$(RUN) ruff check .
	$(RUN) ruff format --check .
	$(RUN) mypy src
	$(RUN) snakefmt --check Snakefile workflow/Snakefile workflow/rules

benchmark: $(MEASURE_VENV)/run.stamp ## measure the solvers; with PEERS=1 public ones too
	@set -e; for subject in surface contact chaos oscillator study; do \
		$(MEASURE_VENV)/bin/python -m workflow.benchmarks.$$subject $(if $(filter 1,$(PEERS)),--peers); \
	done

stress: $(VENV)/run.stamp ## solve thousands of random problems, check each answer independently, keep a summary; two hours
	$(RUN) tests.properties.campaign -j $(JOBS) $(if $(SEED),--seed $(SEED)) $(if $(SHARE),--share $(SHARE)) --output results/stress.json \
		$(if $(SEED)$(SHARE),,--keep results/reference/evidence/stress.json)

verify: $(VENV)/run.stamp ## compare a run with the results that git keeps, and its files with their checksums
	$(RUN) snakemake -j$(JOBS) verify --forcerun verify
	@cat results/verify.txt

faults: $(VENV)/dev.stamp ## kill runs, fill the disk, damage results, 20 times; each time one new run must mend it
	FAULTS=$(or $(COUNT),20) FAULT_SEED=$(or $(SEED),1) $(RUN) pytest -rP tests/workflow/test_faults.py -k mends

schema: $(VENV)/run.stamp ## write the schema and the page of scene keys after a change of the scene types
	$(RUN) roughslip.scene.schema

fuzz: $(VENV)/dev.stamp ## 2000 random scene files: loaded, or refused with a line a mistake
	SCENE_CASES=$(or $(COUNT),2000) $(if $(SEED),SCENE_SEED=$(SEED)) $(RUN) pytest tests/scene/test_scene_files.py

cluster: $(VENV)/cluster.stamp ## run the study on Slurm, see docs/cluster.md
	$(RUN) snakemake --profile profiles/slurm $(SCENE)

reference: $(VENV)/run.stamp ## write results/reference, which git keeps, again
	$(RUN) snakemake -j$(JOBS) && for scene in paper resolved; do (cd results/$$scene && cp $(KEPT) ../reference/$$scene) || exit 1; done
	@for file in results/benchmarks/*.json results/benchmarks/*.svg; do [ ! -f "$$file" ] || cp "$$file" results/reference/evidence/; done

docs: $(DOCS_VENV)/run.stamp ## build the manual in docs/_build/html: notebooks are run, warnings and broken links are errors
	rm -rf docs/_build && $(DOCS_VENV)/bin/python -m sphinx -q -W --keep-going -n -b html docs docs/_build/html
	@echo "open docs/_build/html/index.html"

package: ## build sdist and wheel in dist/; use the wheel in an environment of its own, without the study
	rm -rf dist .cache/wheel && "$(PYTHON)" -m venv .cache/wheel
	.cache/wheel/bin/python -m pip install --quiet --disable-pip-version-check build
	.cache/wheel/bin/python -m build --outdir dist . > .cache/wheel/build.log || { cat .cache/wheel/build.log; false; }
	.cache/wheel/bin/python -m pip install --quiet --disable-pip-version-check dist/*.whl
	NUMBA_CACHE_DIR="$${NUMBA_CACHE_DIR:-$(CURDIR)/.cache/numba}" .cache/wheel/bin/python -I tests/installed.py

clean: ## remove all generated files and .venv; results/reference stays
	rm -rf $(VENV) $(PEERS_VENV) $(DOCS_VENV) docs/_build dist .cache .snakemake .pytest_cache .mypy_cache .ruff_cache .hypothesis
	@if [ -d results ]; then find results -mindepth 1 -maxdepth 1 ! -name reference -exec rm -rf {} +; fi
	@find . -name .git -prune -o \( -name __pycache__ -o -name '*.egg-info' \) -type d -prune -exec rm -rf {} +

# A stamp is a copy of the lock that was installed, and it is written last: an interrupted set-up has none and starts again.
# Stamps are compared by content, because file times mean nothing after a copy.
$(VENV)/run.stamp: FORCE
	@cmp -s requirements.lock $@ || { $(call install-run,requirements.lock) && $(compile); }
	@$(link-source)

$(PEERS_VENV)/run.stamp: FORCE
	@cmp -s requirements-peers.lock $@ || { $(call install-run,requirements-peers.lock); }
	@$(link-source)

$(DOCS_VENV)/run.stamp: FORCE
	@cmp -s requirements-docs.lock $@ || { $(call install-run,requirements-docs.lock); }
	@$(link-source)

$(VENV)/dev.stamp: $(VENV)/run.stamp FORCE
	@cmp -s requirements-dev.lock $@ || { $(call install-more,requirements-dev.lock); }

$(VENV)/cluster.stamp: $(VENV)/run.stamp FORCE
	@cmp -s requirements-cluster.lock $@ || { $(call install-more,requirements-cluster.lock); }

define install-run
$(check-python) && echo "Setting up $(@D), a minute or two" && rm -rf $(@D) && "$(PYTHON)" -m venv $(@D) \
	&& $(@D)/bin/python -m $(PIP_INSTALL) -r $1 && cp $1 $@
endef

# So that Python finds src/roughslip in the active environment too, without PYTHONPATH. Relative, so a folder can move.
define link-source
for folder in $(@D)/lib/python3*/site-packages; do echo ../../../../src > $$folder/roughslip.pth; done
endef

# With the pins of the run, so that neither a tool for checks nor the plug-in of a cluster changes a result.
define install-more
echo "Adding $1 to $(VENV)" && $(RUN) $(PIP_INSTALL) -r $1 -c requirements.lock && cp $1 $@
endef

define check-python
{ command -v "$(PYTHON)" >/dev/null \
	|| { echo "$(PYTHON) is not found: install Python 3.11, 3.12 or 3.13, or name it: make setup PYTHON=/path/to/python3.12" >&2; false; }; } \
&& { "$(PYTHON)" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' \
	|| { echo "$$("$(PYTHON)" -V 2>&1) is not 3.11, 3.12 or 3.13: install one and name it: make setup PYTHON=python3.12" >&2; false; }; } \
&& { "$(PYTHON)" -c 'import venv, ensurepip' 2>/dev/null \
	|| { echo "$(PYTHON) cannot make virtual environments: install its venv (Debian, Ubuntu: apt-get install python3-venv)" >&2; false; }; }
endef
