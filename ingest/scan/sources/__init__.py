"""What is given for a scan, read: pictures with what is known of their cameras, or a mesh."""
