#!/bin/sh
# Runs the peers' calibration problem in Ceres and here, one after the other, and prints the ratios of CPU time.
# usage: benches/peers.sh      (HANDEYE_SHARED: the folder that holds peers/, ../shared by default)
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
shared=$(cd "${HANDEYE_SHARED:-$root/../shared}" 2>/dev/null && pwd) || {
    echo "no folder ${HANDEYE_SHARED:-$root/../shared}: set HANDEYE_SHARED to the one that holds peers/" >&2
    exit 1
}
peers=$shared/peers/calibration
export HANDEYE_SHARED="$shared" OMP_NUM_THREADS=1 RAYON_NUM_THREADS=1

missing=
command -v cmake >/dev/null || missing="$missing cmake"
find /usr/lib /usr/local/lib -name CeresConfig.cmake 2>/dev/null | grep -q . || missing="$missing libceres-dev"
if [ -n "$missing" ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    # shellcheck disable=SC2086
    apt-get install -y $missing >/dev/null 2>&1 && missing=
fi
if [ -n "$missing" ]; then
    echo "Ceres is unavailable: install$missing and run this again (apt-get install -y libceres-dev cmake)" >&2
    exit 1
fi

build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
cmake -S "$peers" -B "$build" -DCMAKE_BUILD_TYPE=Release >"$build/log" 2>&1 &&
    cmake --build "$build" >>"$build/log" 2>&1 || {
    cat "$build/log" >&2
    echo "Ceres is unavailable: its part of the comparison does not build" >&2
    exit 1
}
cargo bench --quiet --manifest-path "$root/Cargo.toml" --bench peers --no-run

# The fastest of Ceres' solvers, default settings: "milliseconds solver".
ceres() {
    for solver in dense_normal_cholesky dense_schur sparse_schur sparse_normal_cholesky; do
        "$build/calib" "$peers/noisy_T50.txt" --solver $solver --joints "$1" --group "$2" --reps 5
    done | sed 's/^ceres \([a-z_]*\).*total(min cpu) *\([0-9.]*\) ms.*/\2 \1/' | sort -n | head -n 1
}

echo "Ceres, noisy_T50 ..." >&2
held_step=$(ceres const step)
held_obs=$(ceres const obs)
free_step=$(ceres free step)
free_obs=$(ceres free obs)
echo "ours ..." >&2
cargo bench --quiet --manifest-path "$root/Cargo.toml" --bench peers | tee "$build/ours"
ours() { awk -v joints="$1" '$1 == "noisy_T50" && $2 == joints { print $3; exit }' "$build/ours"; }

echo
echo "noisy_T50, CPU ms to the optimum            Ceres    ours   ratio  required"
failed=0
line() { # joints, grouping, "milliseconds solver", ours, required ratio
    echo "$3" | awk -v joints="$1" -v group="$2" -v ours="$4" -v required="$5" '{
        ratio = $1 / ours
        printf "joints %s, per %-11s %-22s %6.1f %7.2f %7.1f  %s\n", joints, group, $2, $1, ours, ratio,
            "at least " required ": " (ratio >= required ? "met" : "NOT MET")
        exit ratio < required
    }' || failed=1
}
line held step "$held_step" "$(ours held)" 8
line held observation "$held_obs" "$(ours held)" 20
line free step "$free_step" "$(ours free)" 8
line free observation "$free_obs" "$(ours free)" 20
exit $failed
