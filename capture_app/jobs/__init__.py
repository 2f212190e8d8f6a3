"""Jobs that survive: a queue in a database, and workers that take each other's place."""
