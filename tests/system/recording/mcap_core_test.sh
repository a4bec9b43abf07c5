#!/bin/sh
# Recordings of a mock drive are read by Foxglove's own libraries: mcap_core_test.sh VERGENCE CONFIGURATION SCRIPT FOLDER
# FOLDER keeps the libraries for the next time. Exit 77: npm is not here or reaches no registry.
set -eu
vergence=$1 configuration=$2 script=$3 folder=$4

command -v node >/dev/null && command -v npm >/dev/null || {
  echo "skipped: needs node and npm: sudo apt install nodejs npm"
  exit 77
}
mkdir -p "$folder"
cp "$script" "$folder/read.mjs"
cd "$folder"
if ! [ -d node_modules/@mcap/core ]; then
  echo '{"private": true, "type": "module"}' > package.json
  timeout 100 npm install --no-audit --no-fund --silent \
    @mcap/core@2.2.2 @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0 || {
    echo "skipped: npm reaches no registry: run it with a network, or set npm's registry"
    exit 77
  }
fi
rm -rf drive
"$vergence" run "$configuration" --fast --quiet --duration 4 --record poses,ins,images,pulses --out drive \
  --set cameras.0.size=[320,240] --set cameras.1.size=[320,240] --set mock.texture_detail=0
node read.mjs "$vergence" drive
