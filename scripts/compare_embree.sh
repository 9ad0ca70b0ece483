#!/bin/sh
# Traces the same rays with firstlight and with Embree 4 and prints how they compare.
#
#   scripts/compare_embree.sh [MODELS_FOLDER] [BENCH_OPTIONS...]
#
# Embree comes out of the Python wheel `embreex`, into a folder of its own that is removed afterwards;
# set FIRSTLIGHT_EMBREE to the path of a libembree4 to use that instead.
set -eu
cd "$(dirname "$0")/.."
if [ $# -gt 0 ] && [ -d "$1" ]; then
    FIRSTLIGHT_MODELS=$(cd "$1" && pwd)
    export FIRSTLIGHT_MODELS
    shift
fi
if [ -z "${FIRSTLIGHT_EMBREE:-}" ]; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    python3 -m venv "$folder/venv"
    "$folder/venv/bin/pip" --quiet install 'embreex>=4.4,<5'
    FIRSTLIGHT_EMBREE=$(find "$folder/venv" -name 'libembree4*.so*' | head -n 1)
    export FIRSTLIGHT_EMBREE
fi
[ -f "$FIRSTLIGHT_EMBREE" ] || { echo "no libembree4 at '$FIRSTLIGHT_EMBREE'" >&2; exit 1; }
cargo bench --quiet -p firstlight-benches --bench kernel -- "$@"
