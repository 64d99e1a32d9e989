#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Divides a sequence whose points persist from frame to frame among jobs that run one after the other. From the top of the checkout:
#   scenes/slurm/chain.sh 1-48 4 scenes/slurm/before.txt scenes/slurm/smoke.txt [OPTION OF sbatch]...
# Each job goes on from the checkpoint of the one before. Prints the numbers of the jobs.
set -euo pipefail
frames=${1:?FIRST-LAST} jobs=${2:?the number of jobs} before=${3:?a scene} frame=${4:?a scene}
first=${frames%-*} last=${frames#*-} job=
mkdir -p out
for ((k = 1; k <= jobs; ++k)); do
    end=$((first + (last - first + 1) * k / jobs - 1))
    job=$(sbatch --parsable --kill-on-invalid-dep=yes ${job:+--dependency=afterok:$job} "${@:5}" \
        "$(dirname "$0")/sequence.sbatch" "$first-$end" "$before" "$frame")
    echo "$job"
done
