"""The guided calibration: what do you have, what to record, is it good, and the mount of it."""
