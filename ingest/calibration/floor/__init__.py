"""What an object that stands on the floor tells about the phone clamped to it: tilt, and height."""
