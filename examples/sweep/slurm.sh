#!/bin/bash
#SBATCH --job-name=sweep
#SBATCH --array=1-100
#SBATCH --cpus-per-task=8
#SBATCH --time=04:00:00
#SBATCH --requeue
# A hundredth of the sweep for each task of the array: sbatch slurm.sh
# A task that is requeued goes on where it was; --resume begins if there is nothing to resume.
set -euo pipefail
# The equations are derived once, and kept where every node finds them.
export XDG_CACHE_HOME=$SLURM_SUBMIT_DIR/cache
mkdir -p results
lamc sweep sixbar_markers.yaml tolerances.yaml --resume \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
    --threads "$SLURM_CPUS_PER_TASK" \
    --output "results/$SLURM_ARRAY_TASK_ID.parquet"
