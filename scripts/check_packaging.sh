#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Reads what packagers get with their own tools: package.xml by catkin_pkg, the conda recipe by rattler-build, which also
# renders it, and packaging/debian by dpkg-source and lintian (apt-get install lintian debhelper dpkg-dev). It builds none.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

work=$PWD/build/packaging
mkdir -p "$work"
[[ -x $work/venv/bin/python ]] || python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check catkin-pkg py-rattler-build

"$work/venv/bin/python" - << 'PYTHON'
from catkin_pkg.package import parse_package
from rattler_build import Stage0Recipe, VariantConfig

package = parse_package(".")
package.validate()
print(f"package.xml: {package.name} {package.version}, {package.get_build_type()}")

recipe = Stage0Recipe.from_file("packaging/conda/recipe.yaml")
variants = VariantConfig({"python": ["3.12.* *_cpython"], "c_stdlib": ["sysroot"]})
for variant in recipe.render(variants):
    made = variant.recipe
    print(f"conda: {made.package.name} {made.package.version}")
PYTHON

for tool in dpkg-source lintian dh; do
  command -v "$tool" > /dev/null || { echo "debian: not looked at, there is no $tool"; exit; }
done
version=$(sed -n 's/^project(truing VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
rm -rf "$work/debian"
mkdir -p "$work/debian/truing-$version"
# As in the checkout, committed or not, but without what git ignores.
git ls-files --cached --others --exclude-standard -z | tar -c --null --ignore-failed-read -T - |
  tar -x -C "$work/debian/truing-$version"
tar -C "$work/debian" -czf "$work/debian/truing_$version.orig.tar.gz" "truing-$version"
cp -r packaging/debian "$work/debian/truing-$version/debian"
(
  cd "$work/debian/truing-$version"
  dh build --no-act --buildsystem=pybuild > "$work/dh.log" 2>&1 || { cat "$work/dh.log" >&2; exit 1; }
  cd ..
  dpkg-source --build "truing-$version" > "$work/dpkg-source.log" 2>&1 || { cat "$work/dpkg-source.log" >&2; exit 1; }
  lintian --allow-root --fail-on error,warning "truing_$version-1.dsc"
)
echo "debian: source package of truing $version, nothing that lintian warns of"
