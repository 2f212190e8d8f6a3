"""Method session: the object is scanned and the phone clamped within one ARKit session."""
