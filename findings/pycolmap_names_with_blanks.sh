#!/usr/bin/env bash
# Expected: a text model's pictures keep their names, as COLMAP's binary models keep them.
# Happens: pycolmap 4.2.1 reads images.txt up to the first blank of a name: "my photo 1.jpg" and "my photo 2.jpg" are
#   both "my" then, without a warning.
# Source: https://colmap.github.io/format.html: NAME is the last field of an image's line.
# Matters here: pictures of a model are looked for by name; `ingest/colmap.py` reads the names itself.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet pycolmap==4.2.1
mkdir "$folder/model"
printf '1 PINHOLE 640 480 500 500 320 240\n' > "$folder/model/cameras.txt"
printf '1 0 0 1 255 0 0 0.1 1 0 2 0\n' > "$folder/model/points3D.txt"
printf '1 1 0 0 0 0 0 0 1 my photo 1.jpg\n10 20 1\n2 1 0 0 0 1 0 0 1 my photo 2.jpg\n10 20 1\n' \
    > "$folder/model/images.txt"
"$folder/venv/bin/python" - "$folder/model" <<'PY'
import sys, pycolmap

names = sorted(image.name for image in pycolmap.Reconstruction(sys.argv[1]).images.values())
print("pycolmap", pycolmap.__version__, "reads the names", names)
sys.exit(0 if names == ["my", "my"] else "the behaviour has changed")
PY
