"""From a film of an object to its mesh: the stages joined, the report, and its pictures."""
