#!/usr/bin/env bash
# What takes too long for every change. It says what it ran and saw, in lines that begin with `full:`.
#
#   tests/full/run.sh                  all of it: some hours
#   tests/full/run.sh corpus           every real file of ../shared/meshes (PLANISH_FULL_MESHES: of such names), proven again
#   tests/full/run.sh disk             kills, failures and others at every operation of the disk
#   tests/full/run.sh kills            300 kills of the daemon
#   tests/full/run.sh load             an hour of mixed load (PLANISH_FULL_SECONDS: for so long)
#   tests/full/run.sh recipes          docs/simulate.md, through real solvers: MFEM, NGSolve, Netgen, TetGen, CalculiX
set -euo pipefail
cd "$(dirname "$0")/../.."

heavy() {
  cargo test --release --locked -- --ignored "$1" --nocapture 2>&1 | grep -E '^full:|^test result: FAILED|panicked'
}

corpus() {
  local meshes=../shared/meshes pattern=${PLANISH_FULL_MESHES:-*} out files=() code=0
  if [ ! -d "$meshes" ]; then
    echo "full: corpus: skipped, $meshes is not at hand"
    return
  fi
  cargo build --release --locked
  out=$(mktemp -d)
  trap 'rm -rf "$out"' RETURN
  for file in "$meshes"/$pattern; do
    case $file in *.tsv | *.md | *.txt) ;; *) files+=("$file") ;; esac
  done
  # Exit code 1 says that some were refused: which ones is told below.
  target/release/planish run -q --out "$out" "${files[@]}" || code=$?
  echo "full: corpus: ${#files[@]} files, exit code $code"
  # Its exit code says that no daemon runs.
  { target/release/planish status --out "$out" || true; } | sed -n 's/^results:/full: corpus:/p; s/^  \(refused\|failed\)/full: corpus: \1/p'
  target/release/planish check -q "$out"/*/ || echo "full: corpus: not all results are proven again"
}

# The recipes of docs/simulate.md, in an environment of their own; what needs ccx or tetgen is skipped where these are not there.
recipes() {
  local folder=tests/full/recipes venv code=0
  cargo build --release --locked
  venv=$(mktemp -d)
  trap 'rm -rf "$venv"' RETURN
  python3 -m venv "$venv"
  "$venv/bin/pip" install --quiet --disable-pip-version-check -r "$folder/requirements.txt"
  for recipe in "$folder"/*_*.py; do
    PATH="$PWD/target/release:$venv/bin:$PATH" "$venv/bin/python" -B "$recipe" >"$venv/said" 2>&1 || code=1
    grep '^full:' "$venv/said" || { echo "full: recipes: $(basename "$recipe"): FAILED"; cat "$venv/said"; }
  done
  return "$code"
}

if [ $# = 0 ]; then
  set -- corpus disk kills load recipes
fi
for part in "$@"; do
  case $part in
    corpus) corpus ;;
    disk) heavy full_kills_failures ;;
    kills) heavy full_three_hundred_kills ;;
    load) heavy full_an_hour ;;
    recipes) recipes ;;
    *) echo "usage: $0 [corpus] [disk] [kills] [load] [recipes]" >&2; exit 2 ;;
  esac
done
