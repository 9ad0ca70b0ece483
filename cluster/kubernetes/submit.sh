#!/bin/bash
# Runs rounds of parts until the image is good enough. Stopped in the middle, it continues where the job is.
set -euo pipefail
cd -- @FOLDER@
while true; do
    parts=$(kubectl create -f parts.yaml -o name)
    kubectl wait --for=condition=complete --timeout=-1s "$parts"
    merge=$(kubectl create -f merge.yaml -o name)
    kubectl wait --for=condition=complete --timeout=-1s "$merge"
    said=$(kubectl logs "$merge")
    echo "$said"
    grep -q '^next: round' <<<"$said" || break
done
