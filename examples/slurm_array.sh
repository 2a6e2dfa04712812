#!/usr/bin/env bash
# A batch as a Slurm job array, one shard a task: sbatch --array=1-8 slurm_array.sh
# All tasks write into one folder on a file system that all nodes share; the last one makes the report.
# A task that is preempted or killed goes on where it was when it is requeued.
#SBATCH --job-name=graspd
#SBATCH --cpus-per-task=16
#SBATCH --mem=8G
#SBATCH --requeue
#SBATCH --output=graspd-%A_%a.log
set -euo pipefail

manifest="${MANIFEST:-manifest.toml}"
dataset="${DATASET:-dataset}"
shard=$((SLURM_ARRAY_TASK_ID - ${SLURM_ARRAY_TASK_MIN:-1} + 1))

exec graspd batch "$manifest" -o "$dataset" --shard "$shard/$SLURM_ARRAY_TASK_COUNT" \
    --threads "${SLURM_CPUS_PER_TASK:-$(nproc)}" --resume
