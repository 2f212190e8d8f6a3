"""Where each picture shows the object: its silhouette, told from the floor's look and from depth."""
