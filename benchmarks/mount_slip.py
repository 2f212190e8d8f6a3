"""How often a slip of the clamp is noticed, and how often one is cried that was none.

Usage: python -m benchmarks.mount_slip [takes]

Simulated takes of the carried box with ARKit's noise and a world whose gravity is off (0.4 deg on each
axis over the take, 0.3 more that wanders); the clamp gives way about a random axis at a random moment of the
carry.
"""

import sys
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import LIFT, REST, carried_box, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.report.checked_session import CheckedSession
from ingest.report.stance import object_checks
from ingest.trajectory.object_motion import to_object_motion
from tests.simulator.gravity_error import unlevel
from tests.simulator.slipping import slipping

ANGLES = (0, 1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30)


def main() -> None:
    takes = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    motion, mount = carried_box(), clamped_phone()
    print(
        "slip, deg   tilt it makes, deg   noticed   noticed where the tilt is over 4 deg   time off, s"
    )
    for angle in ANGLES:
        noticed, tilts, late = [], [], []
        for seed in range(takes):
            rng = np.random.default_rng([angle, seed])
            turn = Rotation.from_rotvec(
                np.radians(angle) * Rotation.random(rng=rng).apply([1, 0, 0])
            )
            T = mount.T_phone_object.copy()
            T[:3, :3] = turn.as_matrix() @ T[:3, :3]
            at = rng.uniform(REST + 0.3, len(motion.valid) / 30 - REST - LIFT)
            seen = slipping(motion, mount, replace(mount, T_phone_object=T), at)
            session = unlevel(simulate(seen, mount, seed=seed), seed=seed)
            take = to_object_motion(session, motion.mesh, mount)
            check = object_checks(CheckedSession(session, motion.mesh, mount, take))[-1]
            noticed.append(check.severity != "ok")
            up = T[:3, :3] @ np.array([0.0, 0, 1]) @ mount.T_phone_object[:3, 2]
            tilts.append(np.degrees(np.arccos(np.clip(up, -1, 1))))
            if noticed[-1] and check.frames is not None:
                middle = session.times[np.array(check.frames) - 1].mean() - session.times[0]
                late.append(abs(middle - at - 0.15))
        clear = np.array(noticed)[np.array(tilts) > 4]
        print(
            f"{angle:9d}   {np.median(tilts):19.1f}   {np.mean(noticed):7.3f}"
            f"   {np.mean(clear) if len(clear) else np.nan:37.3f}"
            f"   {np.median(late) if late else np.nan:11.2f}"
        )


if __name__ == "__main__":
    main()
