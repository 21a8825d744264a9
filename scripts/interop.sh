#!/bin/sh
# Runs the FMUs in other masters (docs/interop.md). Their packages are installed into build/interop; unavailable clients are skipped.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh release redysim_fmu describe
[ -x build/interop/bin/python ] || python3 -m venv build/interop
for package in ecospy tbb libcosimpy fmu-manipulation-toolbox pythonfmu fmpy casadi OMSimulator; do
  build/interop/bin/python -m pip show --quiet "$package" >/dev/null 2>&1 && continue
  echo "== install $package"
  build/interop/bin/python -m pip install --quiet --disable-pip-version-check "$package" </dev/null || echo "$package cannot be installed here"
done

# examples/cosimulation imports build_fmu
.venv/bin/python -m pip show --quiet ecospy tbb libcosimpy pythonfmu >/dev/null 2>&1 ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check ecospy tbb libcosimpy pythonfmu </dev/null ||
  echo "the system of FMUs is skipped: its masters cannot be installed here"

# jars GROUP ARTIFACT VERSION FOLDER: an artifact and its dependencies, from Maven Central
jars() {
  folder="build/interop/$4"
  [ ! -d "$folder" ] || return 0
  echo "== fetch $2 $3"
  mkdir -p build/interop/pom
  cat >build/interop/pom/pom.xml <<POM
<project xmlns="http://maven.apache.org/POM/4.0.0">
  <modelVersion>4.0.0</modelVersion><groupId>redysim</groupId><artifactId>interop</artifactId><version>1</version>
  <dependencies><dependency><groupId>$1</groupId><artifactId>$2</artifactId><version>$3</version></dependency></dependencies>
</project>
POM
  mvn -q -B -f build/interop/pom/pom.xml dependency:copy-dependencies -DoutputDirectory="$PWD/$folder" -Dmdep.stripVersion=true </dev/null ||
    { rm -rf "$folder"; echo "$2 cannot be fetched here and is skipped"; }
}
if command -v java >/dev/null && command -v mvn >/dev/null; then
  jars info.laht.fmi4j fmi-import 0.38.0 fmi4j
  jars org.siani.javafmi fmu-wrapper 2.24.3 javafmi
  jars org.into-cps.vdmcheck.fmi2 vdmcheck2 1.1.3 vdmcheck
  # Maestro's jar contains its dependencies
  [ -d build/interop/maestro ] ||
    mvn -q -B dependency:copy -Dartifact=org.into-cps.maestro:maestro:3.1.1:jar:jar-with-dependencies \
      -DoutputDirectory="$PWD/build/interop/maestro" </dev/null ||
    { rm -rf build/interop/maestro; echo "Maestro cannot be fetched here and is skipped"; }
  # the checker reads its rules from files beside its jar
  [ ! -d build/interop/vdmcheck ] || [ -d build/interop/vdmcheck/fmi2schema ] ||
    (cd build/interop/vdmcheck && for part in static-model rule-model vdmcheck2; do
      ../bin/python -c 'import sys, zipfile; zipfile.ZipFile(sys.argv[1]).extractall()' "$part.jar"
    done)
else
  echo "Java or Maven is missing: FMI4j, JavaFMI, Maestro and VDMCheck are skipped"
fi
# about ten minutes, once
PATH="$PATH:$HOME/.cargo/bin"
if command -v cargo >/dev/null; then
  [ -x build/interop/cargo/bin/fmi-sim ] || {
    echo "== build fmi-sim 0.7.0"
    cargo install --quiet fmi-sim --version 0.7.0 --root "$PWD/build/interop/cargo" --target-dir "$PWD/build/interop/cargo/target" </dev/null ||
      echo "fmi-sim cannot be built here and is skipped"
    rm -rf build/interop/cargo/target
  }
else
  echo "cargo is missing: fmi-sim is skipped"
fi
exec .venv/bin/python -m pytest -m interop -rA tests/interop tests/fmi/test_examples_slow.py </dev/null
