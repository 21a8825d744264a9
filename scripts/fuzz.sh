#!/bin/sh
# fuzz.sh [SECONDS]: libFuzzer on the model-file reader, the state deserialiser and call sequences, each for SECONDS (20),
# successively. Findings are stored in build/fuzz/found; add useful ones to tests/fuzz/corpus.
set -eu
cd "$(dirname "$0")/.."
seconds="${1:-20}"
sh scripts/setup.sh clang-14 libclang-rt-14-dev libomp-14-dev
sh scripts/build.sh fuzz model_file_fuzz state_bytes_fuzz calls_fuzz

REDYSIM_FUZZ_RESOURCES="$PWD/build/fuzz/resources"
export REDYSIM_FUZZ_RESOURCES
mkdir -p "$REDYSIM_FUZZ_RESOURCES" build/fuzz/found
cp models/double_pendulum.toml "$REDYSIM_FUZZ_RESOURCES/model.toml"
for target in model_file state_bytes calls; do
  echo "== fuzz $target, $seconds s"
  mkdir -p "build/fuzz/corpus/$target"
  seeds="tests/fuzz/corpus/$target"
  [ "$target" != model_file ] || seeds="$seeds models"
  "build/fuzz/tests/fuzz/${target}_fuzz" -max_total_time="$seconds" -max_len=4096 -timeout=120 -rss_limit_mb=2048 \
    -verbosity=0 -print_final_stats=1 -artifact_prefix="build/fuzz/found/$target-" "build/fuzz/corpus/$target" $seeds ||
    { echo "found: see build/fuzz/found" >&2; exit 1; }
done
