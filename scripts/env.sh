# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
#
# What the scripts agree on; they source it from the root of the checkout.
root=$PWD
jobs=${JOBS:-$(nproc)}
export CMAKE_BUILD_PARALLEL_LEVEL=$jobs CTEST_PARALLEL_LEVEL=$jobs CTEST_OUTPUT_ON_FAILURE=1
export CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}

# The one optimised build: the wheel, the C++ tests, the benchmarks and the consumer project all use its objects.
# pyproject.toml names the same folder.
release=build/release

# Rooms are compiled whole: from nothing that is the fastest. Who changes C++ sets TRUING_UNITY=OFF: then a change
# compiles its file alone.
unity=${TRUING_UNITY:-ON}

# Clang and its sanitizers' runtime are there: it compiles the sanitized tests faster than GCC.
clang_sanitizes() {
  mkdir -p build
  echo 'int main() { return 0; }' | clang++ -fsanitize=address,undefined -x c++ - -o build/sanitizers_link 2> /dev/null
}

# ccache answers for precompiled headers only when told that they may be trusted.
if [[ -z ${CMAKE_CXX_COMPILER_LAUNCHER:-} ]] && command -v ccache > /dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

# configure FOLDER ARGUMENTS...: cmake, whose output is shown only when it fails.
configure() {
  local folder=$1
  shift
  mkdir -p build
  cmake -S . -B "$folder" "$@" > "build/${folder##*/}.configure.log" 2>&1 ||
    { cat "build/${folder##*/}.configure.log" >&2; return 1; }
}
