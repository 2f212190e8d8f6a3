"""`omocap calibrate`: every way to find where the object is in the phone's frame."""
