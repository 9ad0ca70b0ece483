#!/usr/bin/env bash
# Time and error of simplification beside meshoptimizer and fast-simplification, on one model.
#
#     scripts/compare_simplify.sh MODEL.obj [RATIO]      default ratio: 0.2
#
# Needs python3 with venv and a C++ compiler; fetches the package fast-simplification into a temporary folder.
set -euo pipefail
cd "$(dirname "$0")/.."

model=${1:?name a model: scripts/compare_simplify.sh MODEL.obj [RATIO]}
ratio=${2:-0.2}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet fast-simplification
seconds=$("$folder/venv/bin/python" - "$model" "$folder/result.obj" "$ratio" <<'PYTHON'
import sys, time
import fast_simplification, numpy

vertices, triangles = [], []
for line in open(sys.argv[1]):
    words = line.split()
    if words and words[0] == "v":
        vertices.append([float(word) for word in words[1:4]])
    elif words and words[0] == "f":
        corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
        triangles += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
vertices, triangles = numpy.array(vertices, numpy.float32), numpy.array(triangles, numpy.int32)
seconds = []
for _ in range(9):
    start = time.perf_counter()
    points, faces = fast_simplification.simplify(vertices, triangles, target_reduction=1 - float(sys.argv[3]))
    seconds.append(time.perf_counter() - start)
with open(sys.argv[2], "w") as result:
    result.writelines("v %.9g %.9g %.9g\n" % tuple(point) for point in points)
    result.writelines("f %d %d %d\n" % tuple(face + 1) for face in faces)
seconds.sort()
print("%.3f (%.3f–%.3f)" % (seconds[4], seconds[0], seconds[-1]))
PYTHON
)
cargo bench -p firstlight-benches --bench simplify -- "$(realpath "$model")" --ratio "$ratio" \
    --other fast-simplification "$folder/result.obj" "$seconds"
