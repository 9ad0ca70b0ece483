#!/bin/bash
# Submits a round: all of its parts, and the merge once they are done. The argument is the number of the round.
set -euo pipefail
cd -- @FOLDER@
round=${1:-1}
parts=$(sbatch --parsable --array=1-@PARTS@ part.sbatch "$round")
merge=$(sbatch --parsable --dependency="afterok:$parts" --kill-on-invalid-dep=yes merge.sbatch "$round")
echo "round $round: the parts are job $parts, the merge is job $merge"
