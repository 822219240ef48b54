# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# What one types. The work is done by scripts/ and CMake. Every target sets up what it needs by itself.

.PHONY: help setup demo test test-all format tidy bench stubs docs-check site wheel clean distclean
.DEFAULT_GOAL := help

help:
	@echo "make demo        set up, calibrate an example robot, write the report into demo/"
	@echo "make setup       system packages (apt), .venv, truing built and installed into it"
	@echo "make test        every check: format, C++, sanitizers, consumer, Python, stubs, types, examples, docs"
	@echo "make test-all    the same with the tests that are marked slow"
	@echo "make format      format C++ and Python in place"
	@echo "make tidy        clang-tidy over cpp/ (some minutes)"
	@echo "make bench       the benchmarks"
	@echo "make stubs       write python/truing/_core.pyi and _keywords.pyi from the built module"
	@echo "make docs-check  check the links in *.md"
	@echo "make site        the documentation site, into build/site"
	@echo "make wheel       a wheel that other machines install without a compiler, into dist/ (some minutes)"
	@echo "make clean       remove build/ and demo/ (distclean: .venv as well)"
	@echo ""
	@echo "JOBS=n sets the number of compilers at a time, PYTHON=... the interpreter of .venv."

setup:
	@scripts/setup.sh

demo:
	@scripts/setup.sh
	@.venv/bin/truing demo --out demo

test:
	@scripts/test.sh

test-all:
	@scripts/test.sh --all

format:
	@test -x .venv/bin/clang-format -a -x .venv/bin/ruff || scripts/setup.sh --test
	@scripts/format.sh

tidy:
	@scripts/setup.sh --test
	@scripts/tidy.sh

bench:
	@scripts/setup.sh --test
	@scripts/bench.sh

stubs:
	@scripts/setup.sh --test
	@scripts/stubs.sh

docs-check:
	@python3 tests/check_links.py

site:
	@scripts/setup.sh
	@scripts/site.sh

wheel:
	@scripts/wheel.sh

clean:
	rm -rf build demo

distclean: clean
	rm -rf .venv
