#!/usr/bin/env bash
# Expected: a film whose display matrix mirrors it (front cameras write such) is reported as mirrored, or at least as
#   not turned.
# Happens: PyAV 18.1.0 gives `frame.rotation` of 180 or -180 degrees and has no word for the mirroring, and OpenCV
#   5.0.0 shows the film turned by half. Who turns the pictures as told has them standing on their heads.
# Source: ISO 14496-12 6.2.2 (the matrix); av_display_rotation_get of libavutil/display.h returns an angle alone.
# Matters here: films are turned upright before a scan and after an overlay; `ingest/film.py` reads the matrix itself.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet av==18.1.0 opencv-python-headless==5.0.0.93 numpy
cat > "$folder/look.py" <<'PY'
import sys, av, cv2, numpy as np

path = sys.argv[1]
picture = np.zeros((48, 64, 3), np.uint8)
picture[:12, :16] = 255  # a white patch in the top left corner
with av.open(path, "w") as film:
    stream = film.add_stream("libx264", rate=30, options={"crf": "4"})
    stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
    stream.set_display_matrix([-1, 0, 0, 0, 1, 0, 0, 0, 1])  # left and right change places
    for _ in range(3):
        film.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
    film.mux(stream.encode())
with av.open(path) as film:
    frame = next(film.decode(video=0))
    data = next(d for d in frame.side_data if d.type.name == "DISPLAYMATRIX")
    print("PyAV", av.__version__, "rotation:", frame.rotation, "degrees; the matrix:",
          np.frombuffer(bytes(data), "<i4").tolist())
    turned = abs(frame.rotation) == 180
ok, shown = cv2.VideoCapture(path).read()
assert ok
corners = {(r, c): int(shown[r, c].mean()) for r in (4, -5) for c in (4, -5)}
brightest = max(corners, key=corners.get)
where = ("top " if brightest[0] > 0 else "bottom ") + ("left" if brightest[1] > 0 else "right")
print("OpenCV", cv2.__version__, "shows the white patch at the", where + "; the matrix puts it at the top right")
sys.exit(0 if turned and where != "top right" else "the behaviour has changed")
PY
"$folder/venv/bin/python" "$folder/look.py" "$folder/mirrored.mov"
