#!/usr/bin/env bash
#SBATCH --job-name=petcontact
#SBATCH --ntasks=16
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --signal=B:TERM@120
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail

usage() {
    cat <<'END'
usage: sbatch [SBATCH OPTIONS] scripts/slurm.sh [--pypi] [sweep | solve] ARGUMENTS

A Slurm job that runs `petcontact sweep` (or, without a word, the same) or `petcontact solve` over all of its tasks: of a sweep
the cases are dealt out, of a solve the matrices. Submit it from the project's folder, for example

    sbatch --ntasks=64 scripts/slurm.sh sweep configs/tables.toml -o out/
    sbatch --ntasks=4 scripts/slurm.sh solve configs/space_a.toml -o a.h5 --force

after scripts/setup has run there once. An array shares the cases among jobs that need not run at the same time, each of
which may have many tasks; the last command collects what they found (or `petcontact report out/` reads it as it is):

    sbatch --array=1-16 --ntasks=8 scripts/slurm.sh sweep.toml -o out/
    sbatch --ntasks=1 --dependency=singleton scripts/slurm.sh sweep.toml -o out/

One big job is the better choice where the cluster starts it soon: its ranks share the work as it goes, the jobs of an array
by number. With --pypi everything but OpenBLAS lies in the project's folder, which suits
nodes without Debian's PETSc and MPI. Two minutes before its time is over the job is asked to stop and to save what it
has; submitted again with the same arguments a sweep goes on from there, a solve with --set method.start=a.h5.
END
}

case ${1-} in
    -h | --help) usage; exit 0 ;;
esac
if [[ -z ${SLURM_JOB_ID-} ]]; then
    echo "slurm.sh: not in a Slurm job; submit it with sbatch (see scripts/slurm.sh --help)" >&2
    exit 2
fi
# Slurm runs a copy of this script from its spool, so the project is where the job was submitted.
if [[ ! -x $SLURM_SUBMIT_DIR/scripts/run ]]; then
    echo "slurm.sh: submit it from the project's folder; there is no scripts/run in $SLURM_SUBMIT_DIR" >&2
    exit 2
fi

options=(-n "$SLURM_NTASKS")
if [[ ${1-} == --pypi ]]; then
    options+=(--pypi)
    shift
fi
command=sweep
case ${1-} in
    sweep | solve) command=$1; shift ;;
esac
# what is asked to stop has the two minutes to save
export OMPI_MCA_odls_base_sigkill_timeout=110 PRTE_MCA_odls_base_sigkill_timeout=110
export OPENBLAS_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1} OMP_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
cd "$SLURM_SUBMIT_DIR"
part=()
if [[ -n ${SLURM_ARRAY_TASK_ID-} && $command == solve ]]; then
    echo "slurm.sh: an array shares out the cases of a sweep; a solve is one job" >&2
    exit 2
fi
if [[ -n ${SLURM_ARRAY_TASK_ID-} ]]; then
    # tasks may be numbered from anywhere in any steps
    step=${SLURM_ARRAY_TASK_STEP:-1}
    part=(--part "$(((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN) / step + 1))/$(((SLURM_ARRAY_TASK_MAX - SLURM_ARRAY_TASK_MIN) / step + 1))")
fi
exec scripts/run "${options[@]}" "$command" "$@" "${part[@]}"
