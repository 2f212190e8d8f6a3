"""What people touch: command line, pipeline, result folders, exports, the phone simulator."""
