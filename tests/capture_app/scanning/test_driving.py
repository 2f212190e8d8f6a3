"""A mesh that a scan has made goes the rest of the way: a take with it becomes a motion."""

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.pipeline import run_take
from ingest.mesh import load_mesh


def test_a_take_with_the_mesh_of_a_scan_becomes_a_motion(scanned, inputs, weights):
    T_phone_object = np.eye(4)
    T_phone_object[:3, :3] = Rotation.from_euler("x", -90, degrees=True).as_matrix()
    T_phone_object[:3, 3] = [0.0, -0.3, -0.2]
    inputs.write_mount(T_phone_object)
    mesh = scanned.scan.request.output
    # The scan's own check may find the mesh too coarse; here it is the way through that counts.
    request = inputs.request(weights).model_copy(update={"object": mesh, "force": True})
    made = run_take(request, lambda stage, done: None)
    moved = made.object_motion
    np.testing.assert_array_equal(moved.mesh.vertices, load_mesh(mesh).vertices)
    T = moved.T_world_object
    heights = moved.mesh.vertices @ T[:, 2, :3].T + T[:, 2, 3]
    assert np.abs(heights.min(axis=0)[[0, -1]]).max() < 0.005
    assert heights.min(axis=0).max() > 0.2
    assert {m.joints.shape for m in made.motions} == {(len(T), 24, 3)}
    assert all(np.isfinite(m.joints).all() for m in made.motions)
