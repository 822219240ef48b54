#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs a wheel where nothing but Python is, runs `truing demo` there, and says how long both took; then a fit by Ceres,
# which is in the wheel.
#
#   scripts/bare_install.sh dist/truing-....whl
#
# Where: as root, with mmdebstrap installed, in a system of its own (chroot) that holds this release's smallest set of
# packages and python3-venv, no compiler, and no library of truing's. Otherwise in a fresh environment under `env -i`,
# which shows less: libraries that happen to be on this machine would be found. It says which.
# truing's dependencies come from the package index; pip's settings and certificates are those of this machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

wheel=$(realpath "$1")
longest=60 # seconds that the demo may take
bare=$PWD/build/wheel/bare

say() { printf '[bare] %s\n' "$*"; }

make_system() {
  local release
  release=$(. /etc/os-release && echo "$VERSION_CODENAME")
  say "a bare system of $release"
  rm -rf "$bare"
  mkdir -p "$bare"
  mmdebstrap --quiet --variant=minbase --include=python3-venv "$release" "$bare" > build/wheel/bare.log 2>&1 ||
    { tail -n 20 build/wheel/bare.log >&2; return 1; }
  local file
  for file in /etc/pip.conf /etc/resolv.conf /etc/ssl/certs/ca-certificates.crt "${PIP_CERT:-}"; do
    [[ ! -f $file ]] || install -D -m 644 "$file" "$bare$file"
  done
  for file in c++ g++ gcc cc cmake ninja; do
    [[ ! -e $bare/usr/bin/$file ]] || { echo "bare: $file is installed there" >&2; return 1; }
  done
  [[ -z $(find "$bare/usr/lib" "$bare/lib" -name 'liburdfdom*' -o -name 'libceres*' -o -name 'libtinyxml*') ]] ||
    { echo "bare: libraries that the wheel is to bring are installed there" >&2; return 1; }
}

if [[ $(id -u) -eq 0 ]] && command -v mmdebstrap > /dev/null; then
  make_system
  mkdir -p "$bare/work"
  cp "$wheel" "$bare/work/"
  home=/work
  python=/usr/bin/python3
  inside=(chroot "$bare")
else
  say "no root or no mmdebstrap: a fresh environment under env -i, on a machine that has development packages"
  rm -rf "$bare"
  mkdir -p "$bare"
  cp "$wheel" "$bare/"
  home=$bare
  python=$(readlink -f .venv/bin/python)
  inside=()
fi

# Nothing of this shell's environment but the way to the package index.
passed=(HOME="$home" PATH=/usr/bin:/bin LC_ALL=C.UTF-8)
while IFS= read -r line; do passed+=("$line"); done < <(env | grep -iE '^(PIP_CERT|PIP_INDEX_URL|https?_proxy|no_proxy|SSL_CERT_FILE)=' || true)
run() { "${inside[@]}" env -i "${passed[@]}" "$@"; }

run "$python" -m venv "$home/env"
started=$(date +%s%N)
run "$home/env/bin/pip" install --quiet --disable-pip-version-check "$home/$(basename "$wheel")"
installed=$(date +%s%N)
run "$home/env/bin/truing" demo --out "$home/demo" > build/wheel/demo.log 2>&1 || { cat build/wheel/demo.log >&2; exit 1; }
finished=$(date +%s%N)
run test -s "$home/demo/report.html" || { echo "bare: the demo wrote no report" >&2; exit 1; }

run "$home/env/bin/truing" identify "$home/demo/nominal.yaml" "$home/demo/measurements.csv" --solver ceres --out "$home/ceres" \
  > build/wheel/ceres-there.log 2>&1 || { cat build/wheel/ceres-there.log >&2; exit 1; }

seconds() { awk -v ns="$1" 'BEGIN { printf "%.1f", ns / 1e9 }'; }
say "installed in $(seconds $((installed - started))) s, truing demo ran in $(seconds $((finished - installed))) s"
[[ $((finished - installed)) -le $((longest * 1000000000)) ]] || { echo "bare: truing demo took longer than $longest s" >&2; exit 1; }
