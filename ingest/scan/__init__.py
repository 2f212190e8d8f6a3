"""A film or photos of an object, turned into its metric mesh."""
