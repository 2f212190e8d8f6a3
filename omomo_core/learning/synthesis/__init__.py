"""Motion of people moving objects, made from plain mocap: bodies are re-solved to hold the object."""
