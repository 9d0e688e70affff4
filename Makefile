# One command each, with its own set-up: `make run` runs the quick suite, `make test` runs the tests.
# PyBullet has no wheel beyond CPython 3.11, so a python3.11 that really runs is preferred.
PYTHON ?= $(shell for p in python3.11 python3; do $$p -c '' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
USED := $(VENV)/.installed-to-run
OUT ?= crosscheck-out
SUITE ?= quick
CONSTRAINTS ?= -c constraints.txt
comma := ,
EXTRAS := box2d,box2d3,box3d,rapier,dart,physx,drake,motrixsim,newton
# Engines of an extra with another name.
BESIDE := newton_kamino,newton_vbd,newton_semi_implicit

.PHONY: run test test-all recipe extras soak certify lint setup publish apart releases ports tune cures mutants detection tables size nightly docs clean

setup: $(STAMP)

# `make run` installs what it uses, all else needs everything; neither removes what the other has installed. An editable
# install goes stale when entry points or pins change, so both files re-install.
$(USED): EXTRAS_OF := chipmunk,bullet,mujoco,report,shapes
$(STAMP): EXTRAS_OF := all,dev
$(USED) $(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "no working python3.11 or python3 on PATH"; exit 2; }
	@echo "installing $(EXTRAS_OF) into $(VENV): one to five minutes at first"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[$(EXTRAS_OF)]" $(CONSTRAINTS)
	@touch $@ $(USED)

# The verdicts decide the exit status; benchmark and report are made in any case. The answer is printed once, by `run`;
# the path of the report comes last.
run: $(USED)
	@status=0; begun=$$(date +%s); \
	$(BIN)/crosscheck run --$(SUITE) --for-bench --out $(OUT) || status=$$?; \
	test $$status -le 1 || exit $$status; \
	judged=$$(date +%s); \
	echo "verdicts after $$(( judged - begun )) s; now the benchmark and the report"; \
	$(BIN)/crosscheck bench --quick --brief --out $(OUT) || exit 2; \
	timed=$$(date +%s); \
	echo "report:"; \
	$(BIN)/crosscheck report --out $(OUT) || exit 2; \
	ended=$$(date +%s); \
	echo "done after $$(( ended - begun )) s: verdicts $$(( judged - begun )) s, benchmark $$(( timed - judged )) s," \
		"report $$(( ended - timed )) s; by stage: crosscheck --timings COMMAND"; \
	exit $$status

# `setup` has installed the engines and Pinocchio: if one is not there, its tests fail instead of being skipped. PyBullet
# has wheels for CPython 3.11 only.
REQUIRE_ENGINES ?= reference,chipmunk,mujoco$(shell $(BIN)/python -c 'import sys; print(",bullet" * (sys.version_info < (3, 12)))' 2>/dev/null)

# Kernels are compiled first, once per dimension: tests side by side would each compile the same. Bytecode is kept,
# whatever the environment says: each process that a test starts would compile our sources.
test: export PYTHONDONTWRITEBYTECODE :=
test: $(STAMP)
	$(BIN)/crosscheck compile --engine reference
	CROSSCHECK_REQUIRE_ENGINES=$(REQUIRE_ENGINES) CROSSCHECK_REQUIRE_PINOCCHIO=1 $(BIN)/python -m pytest -n auto --dist loadfile $(ARGS)

# Everything there is, before an issue is called resolved.
test-all: export CROSSCHECK_ALL = 1
test-all: test

# What takes hours: everything there is, other versions of Python (PyBullet has no wheels for them), and the newest
# releases of all that we need instead of those that `constraints.txt` names.
nightly: test-all soak
	$(MAKE) certify
	for version in 3.12 3.13; do \
		$(MAKE) test PYTHON=python$$version VENV=.venv-$$version || exit 2; \
	done
	$(MAKE) test VENV=.venv-newest CONSTRAINTS=
	$(MAKE) extras
	CROSSCHECK_REQUIRE_ENGINES=$(EXTRAS) $(BIN)/python -m pytest -n auto -m optional
	$(BIN)/python -m pip install --quiet "solve-nivp>=0.1.2,<0.2"
	CROSSCHECK_ALL=1 $(BIN)/python -m pytest -n auto tests/oracles

# Lines of Python by room.
size:
	@for room in contact_crosscheck reference_solver adapters validation reports tests; do \
		for part in $$room $$room/*/; do \
			git ls-files "$${part%/}/*.py" | xargs -r cat | wc -l | xargs printf '%-40s %7d\n' "$${part%/}"; \
		done; \
	done
	@git ls-files tests/tables/kept | xargs cat | wc -l | xargs printf '%-40s %7d\n' "kept text of tests"

# An engine made by CONTRIBUTING's recipe, from our wheel in a fresh environment; some 80 s of CPU.
recipe: $(STAMP)
	CROSSCHECK_RECIPE=1 $(BIN)/python -m pytest tests/adapters/test_outside_the_checkout.py -n 0 -s

# The documentation, without a network, into docs/_build/html; a warning is an error.
docs: $(STAMP)
	$(BIN)/python -m sphinx -q -W --keep-going docs docs/_build/html

# Optional engines, beside those of `all`; later commands run them too.
extras: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[$(EXTRAS)]" -c constraints.txt

# All faults, 12 000 scene files, 2 000 cells, 60 kills, from a seed of its own (CROSSCHECK_SEED=N repeats one).
soak: $(STAMP)
	CROSSCHECK_SOAK=1 CROSSCHECK_SEED=$${CROSSCHECK_SEED:-$$(date +%s)} \
		$(BIN)/python -m pytest tests/chaos -n 0 --timeout 14400 -p no:randomly

# The reference solver against its stated accuracy; more than ten minutes. ARGS="--help" lists what else it measures.
certify: $(STAMP)
	$(BIN)/python -m tests.verification.certify $(ARGS)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# One full report and the README's pictures, with the commit inside; needs a clean checkout and Chromium.
publish: $(STAMP)
	@test -z "$$(git status --porcelain)" || { echo "commit first: the report carries the commit's hash"; exit 2; }
	$(MAKE) run OUT=$(OUT) SUITE=standard
	mkdir -p reports/published
	cp $(OUT)/report.html reports/published/report.html
	$(BIN)/python -m reports.pictures $(OUT)/report.html reports/published

# Optional engines, in a matrix of their own: half an hour on two busy cores.
apart: extras
	@test -z "$$(git status --porcelain)" || { echo "commit first: the matrix names the commit"; exit 2; }
	mkdir -p $(OUT)
	$(BIN)/crosscheck run --quick $(foreach name,$(subst $(comma), ,$(EXTRAS),$(BESIDE)),--engine $(name)) --out $(OUT) \
		--markdown $(OUT)/engines.md
	@{ echo "# Optional engines"; echo; \
	echo "Checks of the quick suite at $$(git rev-parse --short HEAD), by \`make apart\`; the marks are explained below the table."; echo; \
	cat $(OUT)/engines.md; } > reports/published/engines.md

# History over releases of the engines, with times: environments are built once, what is stored is not run again; about
# an hour at first.
# A release that does not answer is a row with its reason (status 4), and no reason to stop.
RELEASES_OUT ?= crosscheck-releases
MUJOCO_RELEASES ?= 3.0.0,3.0.1,3.1.0,3.1.1,3.1.6,3.2.7,3.3.0,3.3.5,3.3.6,3.3.7,3.4.0,3.5.0,3.7.0,3.8.0,3.8.1,3.9.0,3.10.0,$\
	3.11.0,3.12.0,3.14.0,3.17.0,4.0.0,4.0.1
releases: $(STAMP)
	@test -z "$$(git status --porcelain)" || { echo "commit first: the history carries the commit's hash"; exit 2; }
	for which in "mujoco $(MUJOCO_RELEASES)" "chipmunk 6.4.0.." "bullet 3.2.6.."; do \
		$(BIN)/crosscheck releases $$which --times --out $(RELEASES_OUT) || test $$? -eq 4 || exit 2; \
	done
	$(BIN)/crosscheck dashboard --out $(RELEASES_OUT) --output $(RELEASES_OUT)/releases.html
	$(BIN)/python -m reports.releases $(RELEASES_OUT) $(RELEASES_OUT)/releases.md
	cp $(RELEASES_OUT)/releases.html $(RELEASES_OUT)/releases.md reports/published/

# Ports of MuJoCo, tested beside MuJoCo C of their release, then compared with it for the page Ports; hours of CPU.
ports: $(STAMP)
	$(MAKE) setup VENV=.venv-ports CONSTRAINTS= EXTRAS_OF=mujoco-warp,mujoco-mjx,mujoco-newton,dev
	CROSSCHECK_REQUIRE_ENGINES=mujoco_warp,mujoco_mjx,mujoco_mjx_single,mujoco_newton .venv-ports/bin/python -m pytest -m optional tests/adapters/test_ports_of_mujoco.py
	$(BIN)/crosscheck ports mujoco --keep

# Are the tuned settings of an engine still the best? `make tune ENGINE=bullet`; minutes of CPU.
tune: $(STAMP)
	@test -n "$(ENGINE)" || { echo "which engine? make tune ENGINE=bullet"; exit 2; }
	$(BIN)/crosscheck tune $(ENGINE) --jobs 2

# What mends each engine as shipped, scene by scene, and at what cost: adapters/<engine>/cures.csv; half an hour of
# CPU for MuJoCo, more for Bullet.
cures: $(STAMP)
	for engine in chipmunk mujoco bullet; do $(BIN)/crosscheck cure $$engine --keep || exit 2; done

clean:
	rm -rf $(VENV) $(OUT) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache

# How many of N changes of the code, drawn by a seed, do the tests notice? KERNELS=1: of the solver's kernels. What tests
# reach is recorded first, by `make test`, or with CROSSCHECK_ALL=1 by all tests: half an hour of CPU; then a change costs
# half a minute. Remove `.coverage*` when the code has changed.
N ?= 60
SEED ?= 1
RECORD := .coverage$(if $(KERNELS),.kernels)$(if $(CROSSCHECK_ALL),.all)
PLAIN := $(if $(KERNELS),NUMBA_DISABLE_JIT=1)
mutants: export COVERAGE_FILE = $(RECORD)
mutants: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[mutants]" -c constraints.txt
	test -f $(RECORD) || $(PLAIN) $(BIN)/python -m pytest -n auto --dist loadfile -q --cov-context=test --cov-report= \
		$(if $(KERNELS),tests/reference_solver --timeout 60 --cov=reference_solver,--cov=adapters --cov=validation --cov=reports) \
		|| test -f $(RECORD)
	$(PLAIN) $(BIN)/python tests/mutation/mutants.py --record $(RECORD) --seed $(SEED) --count $(N) $(if $(KERNELS),--kernels)

# What every check and receipt can see, from faults planted in our solver, which passes them all; three minutes of CPU.
detection: $(STAMP)
	COLUMNS=120 $(BIN)/crosscheck list checks --sensitivity > validation/questions/detection.txt

# What scenes are, what is true and allowed in them, what laws predict and profiles set, as kept texts: read their diff.
# And the table in which `ask` searches.
tables: $(STAMP)
	$(BIN)/python tests/tables/make.py
	$(BIN)/python -m reports.symptoms.making
