"""Where the object is: the floor it stands on, and the box around it, from where the cameras look."""
