#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Every check of truing, in order, up to the first that fails, and how long each took.
#
#   scripts/test.sh              all steps
#   scripts/test.sh --all        all steps, and in them the tests marked slow
#   scripts/test.sh cpp python   only these: setup format cpp sanitize consumer python stubs types examples docs
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/env.sh
python=$root/.venv/bin/python

# Recorded data sets, tested against where they are; none is part of the project.
if [[ -z ${TRUING_REALDATA:-} && -d ../shared/data ]]; then
  export TRUING_REALDATA=$root/../shared/data
fi

# ---- The steps. Each is run in a shell of its own, under set -e. -----------------------------------------------------

step_setup() {
  scripts/setup.sh --test
}

step_format() {
  scripts/format.sh --check
}

run_ctest() {
  local which=(-LE slow)
  [[ -z ${TRUING_SLOW_TESTS:-} ]] || which=()
  ctest --test-dir "$1" "${which[@]}"
}

build_tests() {
  configure "$release" -DTRUING_BUILD_TESTS=ON -DTRUING_BUILD_BENCHMARKS=ON -DTRUING_WERROR=ON -DTRUING_UNITY="$unity" \
    -DCMAKE_BUILD_TYPE=Release
  cmake --build "$release"
}

step_cpp() {
  build_tests
  run_ctest "$release"
}

# The library alone is compiled with sanitizers: the test objects are those of the optimised build.
step_sanitize() {
  build_tests
  local compiler=()
  if clang_sanitizes; then
    compiler=(-DCMAKE_CXX_COMPILER=clang++)
  else
    echo "clang++ cannot link the sanitizers' runtime here: the default compiler is used, which takes longer"
  fi
  configure build/sanitize "${compiler[@]}" -DTRUING_BUILD_TESTS=ON -DTRUING_WERROR=ON -DTRUING_SANITIZE=ON -DTRUING_UNITY=ON \
    -DBUILD_SHARED_LIBS=ON -DTRUING_TEST_OBJECTS="$root/$release" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1"
  cmake --build build/sanitize
  run_ctest build/sanitize
}

step_consumer() {
  rm -rf build/prefix
  cmake --install "$release" --component cpp --prefix build/prefix > build/install.log
  cmake -S tests/consumer -B build/consumer -DCMAKE_PREFIX_PATH="$root/build/prefix" -DCMAKE_BUILD_TYPE=Release \
    > build/consumer.configure.log || { cat build/consumer.configure.log; return 1; }
  cmake --build build/consumer
  ctest --test-dir build/consumer -L consumer
}

# The folder to run Python in: the source tree's own python/ must not be importable, only what is installed.
elsewhere() {
  mkdir -p "build/run/$1"
  cd "build/run/$1"
  "$python" - "$root" << 'PYTHON'
import pathlib, sys

import truing
where = pathlib.Path(truing.__file__).resolve()
if not where.is_relative_to(pathlib.Path(sys.argv[1]) / ".venv"):
    sys.exit(f"truing is imported from {where}, not from the installed wheel")
PYTHON
}

step_python() {
  elsewhere python
  local which=(-m "not slow")
  [[ -z ${TRUING_SLOW_TESTS:-} ]] || which=()
  "$python" -m pytest -c "$root/pyproject.toml" --rootdir "$root" -n "$jobs" --dist worksteal --durations 25 \
    "${which[@]}" "$root/tests/python" 2>&1 | tee "$root/build/pytest.log"
}

step_stubs() {
  scripts/stubs.sh --check
}

step_types() {
  elsewhere types
  "$python" -m mypy --config-file "$root/pyproject.toml" --cache-dir "$root/build/mypy_cache" -p truing
  shopt -s nullglob
  local example
  # One at a time: two scripts may well have functions of the same name.
  for example in "$root"/examples/python/*.py; do
    "$python" -m mypy --config-file "$root/pyproject.toml" --cache-dir "$root/build/mypy_cache" "$example"
  done
}

step_examples() {
  # The C++ examples were built with the consumer, against the installed library.
  if compgen -G 'examples/cpp/*.cpp' > /dev/null; then
    [[ -d build/consumer ]] || step_consumer
    ctest --test-dir build/consumer -L example
  fi
  elsewhere examples
  shopt -s nullglob
  local example
  for example in "$root"/examples/python/*.py; do
    printf '%s: ' "examples/python/${example##*/}"
    if ! timeout 300 "$python" "$example" > "${example##*/}.log" 2>&1; then
      printf 'failed\n'
      cat "${example##*/}.log"
      return 1
    fi
    printf 'ran\n'
  done
  # The README's first command, and that of dynamics: the last line is the path of a report that is there.
  local report demo
  for demo in demo "dynamics demo"; do
    printf 'truing %s: ' "$demo"
    # shellcheck disable=SC2086  # two words are meant
    report=$("$root/.venv/bin/truing" $demo --out "${demo// /-}" 2> demo.log | tee -a demo.log | tail -n 1)
    [[ -s ${report#report: } ]] || { printf 'failed\n'; cat demo.log; return 1; }
    printf 'ran\n'
  done
}

step_docs() {
  "$python" tests/check_links.py
  scripts/site.sh
}

# ---- Running them ----------------------------------------------------------------------------------------------------

title() {
  case $1 in
    setup) echo "system packages, .venv, the wheel built and installed" ;;
    format) echo "format, lint, length and complexity of functions" ;;
    cpp) echo "C++ tests, warnings as errors" ;;
    sanitize) echo "C++ tests under AddressSanitizer and UBSan" ;;
    consumer) echo "a project that uses the installed C++ library" ;;
    python) echo "Python tests against the installed wheel" ;;
    stubs) echo "stubs: committed against generated" ;;
    types) echo "types of the installed package and the examples" ;;
    examples) echo "examples, C++ and Python" ;;
    docs) echo "links of the documentation, and its site" ;;
    *) return 1 ;;
  esac
}

duration() {
  printf '%3d min %02d s' $(($1 / 60)) $(($1 % 60))
}

all=(setup format cpp sanitize consumer python stubs types examples docs)
steps=()
for argument in "$@"; do
  case $argument in
    --all) export TRUING_SLOW_TESTS=1 ;;
    *)
      title "$argument" > /dev/null ||
        { echo "scripts/test.sh: no step '$argument'; there are: ${all[*]}" >&2; exit 1; }
      steps+=("$argument")
      ;;
  esac
done
[[ ${#steps[@]} -gt 0 ]] || steps=("${all[@]}")

# Run as "scripts/test.sh" runs itself for one step, so that set -e holds inside the step.
if [[ ${TRUING_TEST_STEP:-} == 1 ]]; then
  "step_${steps[0]}"
  exit
fi

[[ ${steps[0]} == setup || (-x $python && -e .venv/.extras) ]] || {
  echo "scripts/test.sh: .venv is missing or has no test packages; run scripts/setup.sh --test" >&2
  exit 1
}

rm -f build/pytest.log
number=0
table=""
for step in "${steps[@]}"; do
  number=$((number + 1))
  printf '\n==== %d/%d  %s ====\n' "$number" "${#steps[@]}" "$(title "$step")"
  started=$SECONDS
  if ! TRUING_TEST_STEP=1 bash "$root/scripts/test.sh" "$step"; then
    printf '\n==== FAILED: %s (again: scripts/test.sh %s) ====\n' "$(title "$step")" "$step"
    [[ $step == python ]] || printf '%d steps passed, 1 failed\n' $((number - 1))
    if [[ $step == python ]]; then tail -n 1 build/pytest.log; fi
    exit 1
  fi
  printf '==== %s: %s ====\n' "$step" "$(duration $((SECONDS - started)))"
  table+="$(duration $((SECONDS - started)))  $(printf '%-9s' "$step")  $(title "$step")"$'\n'
done

printf '\n==== all %d steps passed ====\n%s%s  together\n' "${#steps[@]}" "$table" "$(duration $SECONDS)"
if [[ -e build/pytest.log ]]; then
  # The tests' own closing line, once more.
  tail -n 1 build/pytest.log
fi
