#!/bin/sh
# Exports a result as GLB, BVH, USD and FBX, imports each into Blender, compares every joint with the
# arrays (--to amass) within 0.1 mm, and draws a still of each:
#
#     tools/check_in_blender.sh RESULT [FOLDER]
#
# Blender runs as its Python module, bpy 5.0.1 (Python 3.11, numpy 1.26), in an environment of its own
# that is made the first time (about 900 MB). BLENDER_PYTHON names a Python that has bpy already.
set -eu
result=${1:?Give a result folder of omocap run.}
folder=${2:-$(mktemp -d)}
here=$(cd "$(dirname "$0")" && pwd)
omocap=${OMOCAP:-$here/../.venv/bin/omocap}
home=${XDG_CACHE_HOME:-$HOME/.cache}/omocap/bpy-5.0.1

if [ -z "${BLENDER_PYTHON:-}" ]; then
    BLENDER_PYTHON=$home/bin/python
    if ! "$BLENDER_PYTHON" -c 'import bpy' 2>/dev/null; then
        python3.11 -m venv "$home"
        "$home/bin/pip" install --quiet numpy==1.26.4 bpy==5.0.1
    fi
fi

mkdir -p "$folder"
# What `blender --background --python SCRIPT -- ...` does, with the module.
blender=$folder/blender
cat > "$blender" <<END
#!/bin/sh
while [ "\$1" != --python ]; do shift; done
shift
exec "$BLENDER_PYTHON" "\$@"
END
chmod +x "$blender"

for kind in bvh glb; do "$omocap" export "$result" --to "$kind" -o "$folder/take.$kind"; done
"$omocap" export "$result" --to amass -o "$folder/take.npz"
"$omocap" export "$result" --to usd -o "$folder/take.usdc"
"$omocap" export "$result" --to fbx --blender "$blender" -o "$folder/take.fbx"
"$BLENDER_PYTHON" "$here/check_in_blender.py" "$folder"
echo "Stills: $folder/blender_*.png"
