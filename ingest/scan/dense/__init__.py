"""The object's surface out of registered pictures: stereo by plane sweeps, LiDAR, both in one volume."""
