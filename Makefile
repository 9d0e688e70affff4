# One command each, with its own set-up: `make run` runs the quick suite, `make test` runs the tests.
# PyBullet has no wheel beyond CPython 3.11, so a python3.11 that really runs is preferred.
PYTHON ?= $(shell for p in python3.11 python3; do $$p -c '' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT ?= crosscheck-out

.PHONY: run test soak lint setup publish tune clean

setup: $(STAMP)

# An editable install goes stale when entry points or pins change, so both files re-install.
$(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "no working python3.11 or python3 on PATH"; exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[all,dev]" -c constraints.txt
	@touch $@

# The verdicts decide the exit status; time and report are made whatever they are. Matrix and report's path come last,
# where they are seen; the verdicts stand on the terminal before the bench as well.
run: $(STAMP)
	@status=0; begun=$$(date +%s); \
	$(BIN)/crosscheck run --quick --out $(OUT) || status=$$?; \
	test $$status -le 1 || exit $$status; \
	echo "matrix after $$(( $$(date +%s) - begun )) s; now time and report"; \
	$(BIN)/crosscheck bench --quick --brief --out $(OUT) || exit 2; \
	$(BIN)/crosscheck report --out $(OUT) >/dev/null || exit 2; \
	$(BIN)/crosscheck show --out $(OUT) || exit 2; \
	echo "all of it took $$(( $$(date +%s) - begun )) s"; \
	exit $$status

# `setup` has installed Pinocchio: if it is not there, the comparison with it fails instead of being skipped.
test: $(STAMP)
	CROSSCHECK_REQUIRE_PINOCCHIO=1 $(BIN)/python -m pytest -n auto

# All faults, 12 000 scene files, 2 000 cells, 60 kills, from a seed of its own (CROSSCHECK_SEED=N repeats one).
soak: $(STAMP)
	CROSSCHECK_SOAK=1 CROSSCHECK_SEED=$${CROSSCHECK_SEED:-$$(date +%s)} \
		$(BIN)/python -m pytest tests/chaos -n 0 --timeout 14400 -p no:randomly

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# One full report and the README's pictures, with the commit inside; needs a clean checkout and Chromium.
publish: $(STAMP)
	@test -z "$$(git status --porcelain)" || { echo "commit first: the report carries the commit's hash"; exit 2; }
	$(MAKE) run OUT=$(OUT)
	mkdir -p reports/published
	cp $(OUT)/report.html reports/published/report.html
	$(BIN)/python -m reports.pictures $(OUT)/report.html reports/published

# Are the tuned settings of an engine still the best? `make tune ENGINE=bullet`; minutes of CPU.
tune: $(STAMP)
	@test -n "$(ENGINE)" || { echo "which engine? make tune ENGINE=bullet"; exit 2; }
	$(BIN)/crosscheck tune $(ENGINE) --jobs 2

clean:
	rm -rf $(VENV) $(OUT) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
