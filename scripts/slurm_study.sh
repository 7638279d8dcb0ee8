#!/usr/bin/env bash
# Spreads a study over the machines of a SLURM cluster: an array of shards, then a job that merges them.
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: slurm_study.sh FILE --out DIR --shards N [OPTION OF SBATCH ...]

  slurm_study.sh paper_sensitivity.yaml --out results --shards 16 --partition=long --cpus-per-task=8 --time=2:00:00

FILE, DIR and the program derail must be where every node sees them under the same path. A shard whose node is lost is
queued again and computes only what is missing. The same command again does that for shards that failed or ran out of time.
Logs are in DIR/slurm. DERAIL names the program if it lies neither beside this script nor in PATH nor in a sourced workspace.
TEXT
}

refuse() {
  echo "slurm_study.sh: $1" >&2
  exit 2
}

file='' out='' shards=''
options=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --help | -h) usage; exit 0 ;;
    --out | --shards)
      [[ $# -ge 2 ]] || refuse "$1: missing value"
      [[ $1 == --out ]] && out=$2 || shards=$2
      shift
      ;;
    --out=*) out=${1#*=} ;;
    --shards=*) shards=${1#*=} ;;
    -*) options+=("$1") ;;
    *)
      [[ -z $file ]] || refuse "$1: a second study file; write options of sbatch as --option=value"
      file=$1
      ;;
  esac
  shift
done
if [[ -z $file || -z $out || -z $shards ]]; then
  usage >&2
  exit 2
fi
[[ -r $file && -f $file ]] || refuse "$file: cannot be read"
[[ $shards =~ ^[1-9][0-9]{0,5}$ ]] || refuse "--shards = $shards: out of range; allowed: 1 to 999999"
command -v sbatch > /dev/null || refuse "sbatch: not installed (Debian: slurm-client)"

find_derail() {
  local candidate
  for candidate in "${DERAIL:-}" "$(dirname "${BASH_SOURCE[0]}")/derail" "$(command -v derail || true)" \
    "$(catkin_find --first-only --libexec train_derail derail 2> /dev/null || true)"; do
    if [[ -n $candidate && -x $candidate && -f $candidate ]]; then
      realpath "$candidate"
      return
    fi
  done
  refuse "derail: not found; DERAIL=/path/to/derail says where it is"
}
derail=$(find_derail)

# sbatch would take it for an escape in the names of logs.
[[ $out != *\\* && $PWD != *\\* ]] || refuse "--out = $out: a backslash in the path of the results"
mkdir -p -- "$out/slurm"
file=$(realpath -- "$file")
out=$(realpath -- "$out")
logs=${out//%/%%}/slurm
study="$(printf '%q ' "$derail" study "$file" --out "$out" --resume --quiet)"
merge="$(printf '%q ' "$derail" merge "$file" --out "$out")"

# --parsable: "id" or "id;cluster".
array=$(sbatch --job-name="derail" --cpus-per-task=1 "${options[@]}" --parsable --array="1-$shards" --requeue \
  --open-mode=append --output="$logs/shard-%a.log" << JOB
#!/bin/bash
exec $study --shard "\$SLURM_ARRAY_TASK_ID/$shards" --jobs "\$SLURM_CPUS_PER_TASK"
JOB
)
array=${array%%;*}
last=$(sbatch --job-name="derail-merge" "${options[@]}" --parsable --requeue --dependency="afterok:$array" \
  --kill-on-invalid-dep=yes --output="$logs/merge.log" << JOB
#!/bin/bash
exec $merge
JOB
)
echo "shards: job $array; merge: job ${last%%;*}; logs: $out/slurm"
